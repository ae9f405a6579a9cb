"""The viewer as a person meets it: in a browser, with a mouse."""

import io
import json
import math
import os
import shutil
import signal
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from opspace.loop.requests import FILE
from opspace.record import load
from opspace.runs.run import SCENARIO, run_scenario
from opspace.scenario.load import load_scenario
from tests.view.command import started

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
]

# Rendering without a graphics card takes its time.
PATIENCE = 180_000.0
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
STORY = """
robot: puma560
duration: 1.0
tasks:
  orientation: {type: orientation, level: 0}
  position: {type: position, level: 1, max_speed: 0.6}
  elbow: {type: joint, joint: joint3, level: 2, present: false}
  posture: {type: posture, level: 3, kp: 30}
"""
GUARDED = """
robot: panda
duration: 1.0
torque_limits: priority
tasks:
  posture: {type: posture, level: 0}
collisions:
  obstacles:
    ball: {shape: ball, radius: 0.08, position: [0.5, 0.45, 0.6]}
    table: {shape: half-space, position: [0, 0, 0.1], normal: [0, 0, 1], ignore: [panda_link1]}
"""
PRESSED = """
robot: puma560
duration: 1.0
tasks:
  press: {type: force, level: 0, force: -10, axes_frame: world, contact: [1, 4]}
  upright: {type: orientation, level: 1, kp: 400}
  spring: {type: impedance, level: 2, stiffness: [800, 800, 0]}
  posture: {type: posture, level: 3, kp: 20}
plant:
  surfaces:
    - {point: [0.64, -0.15, 0.766], stiffness: 10000}
"""
PICTURES = Path(os.environ.get("OPSPACE_SCREENSHOTS", ""))
"""Where screenshots are kept to be looked at; not at all where the variable is not set."""


@pytest.fixture
def run(tmp_path, request):
    """A run on a page: its directory, its address, and the process."""
    (tmp_path / "story.yaml").write_text(getattr(request, "param", STORY))
    out = tmp_path / "run"
    words = ["view", str(tmp_path / "story.yaml"), "--out", str(out), "--port", "18480"]
    process = started(*words)
    line = process.stdout.readline()
    address = next(word for word in line.split() if word.startswith("http"))
    yield out, address, process
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60.0)


@pytest.fixture
def chromium():
    sync = pytest.importorskip("playwright.sync_api")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


def opened(browser, address, width=1280, height=800):
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    page.wait_for_selector("[data-opspace-task]")
    return page


def picture(page, name):
    found = page.screenshot(timeout=PATIENCE)
    if PICTURES.name:
        PICTURES.mkdir(parents=True, exist_ok=True)
        (PICTURES / f"{name}.png").write_bytes(found)
    return np.asarray(Image.open(io.BytesIO(found)).convert("RGB")).astype(int)


def is_blank(image):
    """A floor alone has thin grey lines on white; a robot has shades."""
    return (image.max(axis=2) < 200).mean() < 0.01


def choose(page, label, value):
    page.get_by_label(label, exact=True).click(force=True)
    page.get_by_role("option", name=value, exact=True).click(force=True)


def press(page, name):
    page.get_by_role("button", name=name, exact=True).click(force=True)


def until(condition, what):
    end = time.monotonic() + PATIENCE / 1000.0
    while not condition():
        assert time.monotonic() < end, f"never {what}"
        time.sleep(0.2)


def activation(page, task):
    shown = page.locator(f"[data-opspace-task='{task}']")
    text = shown.inner_text(timeout=PATIENCE)
    return math.nan if "–" in text else float(shown.get_attribute("data-opspace-h"))


def asked(out):
    path = out / FILE
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def blue_arrow(image):
    """Where the arrow is that moves a target up and down: the blue of the handle, not of the panel."""
    red, green, blue = image[:, :900].transpose(2, 0, 1)
    found = np.argwhere((blue > 190) & (blue - red > 90) & (abs(green - 140) < 45))
    assert len(found) > 20, "no handle to be seen"
    lowest = found[found[:, 0] >= np.quantile(found[:, 0], 0.9)]
    y, x = np.median(lowest, axis=0)
    return float(x), float(y)


def red_arrow(image):
    """Where the arrow is that moves the obstacle on the right along x."""
    red, green, blue = image[150:, :900].transpose(2, 0, 1)
    found = np.argwhere((red > 190) & (red - blue > 90) & (red - green > 90))
    assert len(found) > 20, "no handle to be seen"
    right = found[found[:, 1] >= np.quantile(found[:, 1], 0.85)]
    y, x = np.median(right, axis=0)
    return float(x), float(y) + 150.0


def test_insert_swap_remove_and_drag(run, chromium):
    out, address, _ = run
    page = opened(chromium, address)
    until(lambda: len(load_rows(out)) > 500, "the run goes on once a browser is there")
    until(lambda: not is_blank(picture(page, "tasks-1280")[150:, :900]), "the robot was drawn")

    choose(page, "Task", "elbow")
    press(page, "Insert")
    until(lambda: asked(out), "the insertion was asked for")
    until(lambda: activation(page, "elbow") == 1.0, "the task was there")
    choose(page, "Swap with", "posture")
    press(page, "Swap")
    until(lambda: len(asked(out)) == 2, "the swap was asked for")
    press(page, "Remove")
    until(lambda: len(asked(out)) == 3, "the removal was asked for")
    until(lambda: math.isnan(activation(page, "elbow")), "the task was gone")
    assert [entry["kind"] for entry in asked(out)] == ["insert", "swap", "remove"]

    x, y = blue_arrow(picture(page, "before-drag"))
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 6):
        page.mouse.move(x, y - 12.0 * step)
    page.mouse.up()
    until(lambda: asked(out)[-1]["kind"] == "lead", "the target was dragged")
    time.sleep(2.0)
    picture(page, "after-drag")
    for tab in ("Joints", "Charts"):
        page.get_by_role("tab", name=tab).click(force=True)
        time.sleep(1.0)
        picture(page, f"{tab.lower()}-1280")

    page.close()
    process = run[2]
    process.send_signal(signal.SIGINT)
    process.wait(60.0)
    recording = load(out)
    height = recording["tool/z"]
    assert height[-1] - height[0] > 0.01, "the tool followed the hand"
    guest = recording["tasks/elbow/activation"]
    assert np.nanmax(guest) == 1.0
    assert np.isnan(guest[[0, -1]]).all()
    step = np.abs(np.diff(recording.group("tau"), axis=0)).max()
    assert step < 3.0, "nothing of this is a jolt"
    # The same requests without a browser: the same numbers.
    again = run_scenario(load_scenario(out / SCENARIO), out.parent / "again", requests=out / FILE)
    np.testing.assert_array_equal(again.recording.data, recording.data)


@pytest.mark.parametrize("run", [GUARDED], indirect=True)
def test_an_obstacle_is_dragged_at_the_arm(run, chromium):
    out, address, process = run
    page = opened(chromium, address)
    until(lambda: len(load_rows(out)) > 500, "the run goes on once a browser is there")
    page.get_by_role("tab", name="Distances").click(force=True)
    until(lambda: page.locator("[data-opspace-pair]").count() > 3, "the nearest pairs were told")
    page.get_by_label("Shapes of the links").click(force=True)
    until(lambda: not is_blank(picture(page, "obstacles-1280")[150:, :900]), "it was drawn")
    x, y = red_arrow(picture(page, "obstacles-before-drag"))
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 6):
        page.mouse.move(x + 15.0 * step, y)
    page.mouse.up()
    until(lambda: asked(out) and asked(out)[-1]["kind"] == "place", "the ball was dragged")
    time.sleep(2.0)
    picture(page, "obstacles-after-drag")
    page.close()
    process.send_signal(signal.SIGINT)
    process.wait(60.0)
    recording = load(out)
    way = recording.group("obstacles/ball/position")
    assert np.linalg.norm(way[-1] - way[0]) > 0.03
    assert np.min(recording["distances/least"]) > 0.009
    assert np.abs(np.diff(recording.group("tau"), axis=0)).max() < 3.0
    again = run_scenario(load_scenario(out / SCENARIO), out.parent / "again", requests=out / FILE)
    np.testing.assert_array_equal(again.recording.data, recording.data)


@pytest.mark.parametrize("run", [PRESSED], indirect=True)
def test_a_table_is_pressed_harder_from_the_page(run, chromium):
    out, address, process = run
    page = opened(chromium, address)
    bar = page.locator("[data-opspace-touch='press']")
    until(lambda: bar.get_attribute("data-opspace-c") == "1.000", "the table was touched")
    assert "10.0 N" in bar.inner_text()
    until(lambda: yellow(picture(page, "pressing-10")) > 20, "the force was drawn")
    before = yellow(picture(page, "pressing-10"))
    slide(page, "press [N]", 30.0)
    until(lambda: asked(out), "another force was asked for")
    until(lambda: "30.0 N" in bar.inner_text(), "it was there")
    until(lambda: yellow(picture(page, "pressing-30")) > 2.0 * before, "the arrow grew")
    slide(page, "spring [%]", 50.0)
    until(lambda: asked(out)[-1]["kind"] == "spring", "a softer spring was asked for")
    time.sleep(1.0)
    page.close()
    process.send_signal(signal.SIGINT)
    process.wait(60.0)
    recording = load(out)
    assert recording["wrench/tool/z"][-1] == pytest.approx(-30.0, abs=0.5)
    assert asked(out)[-1]["stiffness"] == [400.0, 400.0, 0.0]
    again = run_scenario(load_scenario(out / SCENARIO), out.parent / "again", requests=out / FILE)
    np.testing.assert_array_equal(again.recording.data, recording.data)


def slide(page, label, value):
    """Type a number beside a slider."""
    beside = "xpath=ancestor::div[.//input[@type='text']][1]//input[@type='text']"
    field = page.get_by_text(label, exact=True).locator(beside)
    field.fill(f"{value:g}")
    field.press("Enter")


def yellow(image):
    """How much of the picture, below its notes, is the arrow of a measured force."""
    red, green, blue = image[200:, :900].transpose(2, 0, 1)
    return int(((red > 170) & (green > 120) & (blue < 110) & (red - blue > 90)).sum())


def load_rows(out):
    return np.fromfile(out / "data.f64") if (out / "data.f64").exists() else np.zeros(0)


def test_a_recording_on_a_small_screen(tmp_path, chromium):
    run_scenario(load_scenario("singularity"), tmp_path / "run")
    process = started("view", str(tmp_path / "run"), "--port", "18580")
    try:
        address = next(w for w in process.stdout.readline().split() if w.startswith("http"))
        page = opened(chromium, address, 800, 700)
        press(page, "Pause")
        until(lambda: not is_blank(picture(page, "recorded-800")[150:, :400]), "it was drawn")
        assert page.get_by_role("button", name="Insert", exact=True).count() == 0
        boxes = [element.bounding_box() for element in page.locator("[data-opspace-task]").all()]
        assert all(box["x"] >= 400 and box["x"] + box["width"] <= 800 for box in boxes)
        assert all(
            below["y"] >= above["y"] + above["height"] - 1.0 for above, below in pairwise(boxes)
        ), "texts overlap"
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60.0)
