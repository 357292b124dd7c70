"""`matbench check`: does a method keep its promises to the harness? It is tried on small scenes and judged.

The scenes are in `matbench.solving.check_scenes`, one solve in a process of its own is in
`matbench.solving.check_solve`, and the verdicts are in `matbench.solving.check_verdicts`.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from matbench.plans.plan import Method, plugin_of
from matbench.solving import processes
from matbench.solving.check_scenes import trials
from matbench.solving.check_solve import Answer, solve_apart
from matbench.solving.check_verdicts import CheckResult, judge
from matbench.solving.environment import kernel_cache_in_use, without_main


def check(
    method: Method,
    files: Sequence[Path] = (),
    timeout: float = 120,
    listen: Callable[[int, int, str], None] | None = None,
) -> list[CheckResult]:
    """Try a method on all trials and judge its answers.

    Parameters
    ----------
    files
        The users' own files with methods.
    timeout
        Seconds that one solve may take; if the first one takes longer, nothing else is tried.
    listen
        Called before each trial: how many are done, how many there are, and the name of the next.

    Returns
    -------
    One result for each check, always the same checks in the same order.
    """
    entry = plugin_of(method, files).entry
    wanted, answers = trials(), {}
    module = [] if isinstance(entry, type) else [entry.module]
    with without_main(), kernel_cache_in_use():
        processes.start_server(["matbench.solving.method_check", *module])
        for done, (name, trial) in enumerate(wanted.items()):
            if listen is not None:
                listen(done, len(wanted), name)
            answers[name] = solve_apart(method, files, trial, timeout)
            if answers["easy"].error.startswith("no answer within"):
                break
    untried = Answer(reason="not tried, as the first answer did not come")
    return judge({name: answers.get(name, untried) for name in wanted})
