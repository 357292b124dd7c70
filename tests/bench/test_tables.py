"""Tables of timings."""

from io import StringIO

from attrs import evolve

from matbench.bench import base, tables
from matbench.bench.baselines import Judged
from matbench.bench.measuring import Timing
from matbench.bench.turns import Turns
from matbench.commands.console import Console


def test_tables_fit_eighty_columns() -> None:
    against = base.versus("long", [Turns(1.285), Turns(1.3)])
    longest = "materiality[preset=descent]"
    timing = Timing(1215.3, 1000, 1215.3, 0.0375, 1e-4, "method", 25)
    one = Judged(longest, "slower", timing, (1215.3,), 1090.0, against)
    for table in (tables.judged([one]), tables.compared([evolve(against, name=longest)], 0.15, "origin/main")):
        out = StringIO()
        Console(file=out, width=80).print(table.rich())
        assert all(cell in out.getvalue() for row in table.rows for cell in row)
