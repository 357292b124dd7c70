"""What the harness writes for papers goes through LaTeX."""

import subprocess
from pathlib import Path

from tools import need


def compile_latex(body: str, folder: Path) -> None:
    """Set a page with the packages that tables and figures name; whatever LaTeX refuses is an error."""
    (program,) = need("tex")
    packages = r"\usepackage[T1]{fontenc}\usepackage{textcomp}\usepackage{graphicx}\usepackage{booktabs}"
    (folder / "t.tex").write_text(rf"\documentclass{{article}}{packages}\begin{{document}}{body}\end{{document}}")
    line = [program, "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "t.tex"]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, errors="replace", timeout=120)
    assert done.returncode == 0, done.stdout[-2000:]
    assert (folder / "t.pdf").stat().st_size > 1000
