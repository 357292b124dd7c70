#!/usr/bin/env bash
# The README's two pictures and that of the worlds, made anew: `docs/pictures.sh`, some minutes; needs chromium, its driver, and selenium.
# Synthetic scenes only: pictures of others' scenes do not belong into the repository.
set -euo pipefail
cd "$(dirname "$0")/.."
runs=$(mktemp -d)
trap 'rm -rf "$runs"; kill "${viewer:-}" 2>/dev/null || true' EXIT

matbench compare -a materiality multiview_sgm okutomi_kanade sgbm -s 'synthetic/*[size=160x120]' --steady --out "$runs/synthetic"
matbench compare -a 'materiality[preset=descent passes=20]' -s synthetic/spheres --record --out "$runs/recording"
python docs/screenshot.py "file://$runs/synthetic/report.html" docs/images/report.png

python docs/worlds_sheet.py

BROWSER=true matbench view "$runs/recording" --web >"$runs/said" 2>&1 &
viewer=$!
for _ in $(seq 60); do
    url=$(grep -o 'http://[^ ]*' "$runs/said" | tail -1 || true)
    [ -n "$url" ] && break
    sleep 1
done
python docs/screenshot.py "$url&renderer=webgl" docs/images/recording.png --wait 45
