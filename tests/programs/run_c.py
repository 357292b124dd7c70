"""The `run` script of the C program beside it: LEFT RIGHT NDISP OUTDIR."""

import subprocess
import sys
from pathlib import Path

import cv2

out = Path(sys.argv[4])
for name, path in zip(("left", "right"), sys.argv[1:3], strict=True):
    cv2.imwrite(str(out / f"{name}.pgm"), cv2.imread(path, cv2.IMREAD_GRAYSCALE))
matcher = Path(__file__).with_name("matcher")
sys.exit(subprocess.run([matcher, out / "left.pgm", out / "right.pgm", sys.argv[3], out / "disp0.pfm"]).returncode)
