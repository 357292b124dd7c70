"""What the registry knows."""

from matbench.datasets.registry import YEARS, registry

KNOWN = {year: registry(year) for year in YEARS}


SCENES = [
    (year, name, size, facts)
    for year, known in KNOWN.items()
    for name, sizes in known.scenes.items()
    for size, facts in sizes.items()
]
