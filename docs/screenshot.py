"""Take a picture of a page in a headless Chromium.

python docs/screenshot.py URL FILE.png [--wait SECONDS]
"""

import argparse
import time
from contextlib import suppress
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.common.exceptions import TimeoutException

SIZE = (1366, 900)
TRIES = 6
FLAGS = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("url")
    parser.add_argument("file", type=Path)
    parser.add_argument("--wait", type=float, default=3)
    given = parser.parse_args()
    options = webdriver.ChromeOptions()
    for flag in (*FLAGS, "--ignore-gpu-blocklist", "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1] + 87}"):
        options.add_argument(flag)
    browser = webdriver.Chrome(options=options)
    browser.get(given.url)
    for _ in range(TRIES):  # where a processor draws instead of a graphics card, an answer may take long
        time.sleep(given.wait)
        with suppress(TimeoutException):
            browser.save_screenshot(str(given.file))
            break
    browser.quit()
    with Image.open(given.file) as picture:  # a palette makes it a third as large
        picture.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(given.file, optimize=True)


if __name__ == "__main__":
    main()
