"""The metrics that can be asked for by name: built-in ones, those of plug-ins and of users' own files, and families."""

from collections.abc import Iterable, Mapping
from functools import cache

from matbench.errors import UserError, refuse_hidden, unknown
from matbench.measures.confidence import ConfidenceMetric
from matbench.measures.families import AT, Family
from matbench.measures.metrics import Better, Metric
from matbench.measures.prediction import PredictionMetric
from matbench.measures.volume_metrics import VolumeMetric
from matbench.plans import plugins

AnyMetric = Metric | VolumeMetric | PredictionMetric | ConfidenceMetric


def metrics() -> tuple[AnyMetric, ...]:
    """All metrics that have a name of their own: built-in ones, those of installed plug-ins, and those of own files.

    Broken plug-ins are left out (`broken_metrics`). `families` has further ones.

    Raises
    ------
    UserError
        If a metric in a user's own file is of no known kind, or its name is taken.
    """
    return tuple(one for one in _offered().values() if not isinstance(one, Family))


def families() -> tuple[Family, ...]:
    """The families of metrics: their members differ by a number in the name, such as ``bad_3``."""
    return tuple(one for one in _offered().values() if isinstance(one, Family))


def _offered() -> dict[str, AnyMetric | Family]:
    """Name -> metric or family: the installed ones, then those of users' own files in use."""
    found = dict(_installed()[0])
    for file in plugins.used():
        for metric in plugins.own_metrics(file):
            if not isinstance(metric, AnyMetric | Family):
                raise UserError(f"{file}: {type(metric).__name__} is no metric: make it of matbench.Metric")
            refuse_hidden(f"{file}: metric", f"{metric.name} {getattr(metric, 'unit', '')}")
            # an equal metric under the same name is no clash: a file may import a built-in one
            if found.setdefault(metric.name, metric) != metric or _is_of_another(metric.name, found):
                raise UserError(f"{file}: the name of metric {metric.name!r} is taken; give it another one")
    return found


def _is_of_another(name: str, known: Mapping[str, AnyMetric | Family]) -> bool:
    """Would a family give its own metric that name?"""
    return name not in _installed()[0] and any(
        isinstance(one, Family) and one.number(name) is not None for one in known.values()
    )


def metric_named(name: str) -> AnyMetric:
    """The metric of that name.

    Raises
    ------
    UserError
        If there is no such metric.
    """
    known = _offered()
    if isinstance(known.get(name), AnyMetric):
        return known[name]  # type: ignore[return-value]
    for one in families():
        if (found := one.named(name)) is not None:
            if not isinstance(found, AnyMetric):
                raise UserError(f"metric {name}: family {one.name} made no matbench.Metric for it")
            return found
    small = name.lower()
    meant = [small] if small != name and any(one.number(small) is not None for one in families()) else []
    raise unknown("metric", name, [*known, *meant])


def better(name: str) -> Better:
    """Which direction of a metric is better.

    Raises
    ------
    UserError
        If there is no such metric.
    """
    return metric_named(name).better


def wanted(names: Iterable[str] = ()) -> tuple[AnyMetric, ...]:
    """The metrics that a run computes: those of every run, then those named, with what stands beside them.

    Raises
    ------
    UserError
        If there is no such metric.
    """
    found = {metric.name: metric for metric in metrics() if getattr(metric, "always", True)}
    for name in names:
        found.setdefault((metric := metric_named(name)).name, metric)
        for family in families():
            number = family.number(metric.name)
            for beside in family.beside if number is not None else ():
                found.setdefault((other := metric_named(beside.replace(AT, str(number)))).name, other)
    return tuple(found.values())


def broken_metrics() -> Mapping[str, str]:
    """Installed plug-in -> what is wrong with it, if it cannot be imported or offers no metric of a new name."""
    return _installed()[1]


@cache
def _installed() -> tuple[Mapping[str, AnyMetric | Family], Mapping[str, str]]:
    found: dict[str, AnyMetric | Family] = {}
    broken: dict[str, str] = {}
    # built-in metrics first: no plug-in can take one of their names
    by_source = sorted(plugins.installed("metrics").values(), key=lambda p: p.source != plugins.OWN)
    for plugin in by_source:
        try:
            loaded = plugin.load()
            offered = [loaded] if isinstance(loaded, AnyMetric | Family) else list(loaded)
        except (UserError, TypeError) as error:
            broken[plugin.name] = str(error)
            continue
        if all(isinstance(metric, AnyMetric | Family) and metric.name not in found for metric in offered):
            found |= {metric.name: metric for metric in offered}
        else:
            broken[plugin.name] = f"plug-in {plugin.name!r} from {plugin.source} offers no Metric of a new name"
    return found, broken


def of_volumes(name: str) -> bool:
    """Does a metric need the volumes of the cells?"""
    return isinstance(metric_named(name), VolumeMetric)
