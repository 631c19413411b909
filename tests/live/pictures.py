"""Draws the pictures of scenes/live.md: python3 pictures.py FOLDER. Called by ./dev live-pictures."""

import base64
import pathlib
import sys
import time

from browser import Browser, Live

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"
SIZE = 1280, 900


def settle(browser, lines):
    browser.wait(f"window.live?.lines > {lines}", 240)
    browser.wait("live.scene.faces > 0", 120)
    time.sleep(1.0)


def point_at(browser, across, down):
    left, top, wide, high = browser.run("const b = document.getElementById('marks').getBoundingClientRect();"
                                        "return [b.left, b.top, b.width, b.height]")
    browser.mouse("mouseMoved", left + across * wide, top + down * high)
    time.sleep(0.8)


def save(browser, file):
    shot = browser.devtools("Page.captureScreenshot", format="jpeg", quality=74)["data"]
    file.write_bytes(base64.b64decode(shot))
    print(f"{file} ({file.stat().st_size // 1000} kB)")


def main(folder):
    with Live(SCENES / "ripples.toml", "--pings-per-s", "20") as live, Browser(*SIZE) as browser:
        browser.theme("dark")
        browser.open(live.address)
        settle(browser, 470)
        point_at(browser, 0.78, 0.4)
        save(browser, folder / "dark.jpg")
    with Live(SCENES / "mines.toml", "--pings-per-s", "30") as live, Browser(*SIZE) as browser:
        browser.theme("light")
        browser.open(live.address)
        settle(browser, 560)
        browser.click("labels")
        point_at(browser, 0.3, 0.55)
        save(browser, folder / "light.jpg")


if __name__ == "__main__":
    to = pathlib.Path(sys.argv[1])
    to.mkdir(parents=True, exist_ok=True)
    main(to)
