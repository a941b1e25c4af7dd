"""The explorer in a real browser: its closed form is Python's, and what it shows and takes is what it says."""

from __future__ import annotations

import itertools
import json
import math
import os
import shlex

import explorer_reference as reference
import numpy as np
import pytest
import scipy.stats
from chromium import Chromium

from hdopt.drive.errors import study_key
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.kinematics.waveform import CLOSED_FORM, kinematic_error_arcmin, relative_turn
from hdopt.mechanics.bending import max_curvature_change
from hdopt.mechanics.contact import contact_angle
from hdopt.recordings.orders import model_orders, order_spectrum
from hdopt.study import load_study
from hdopt.workflow.explore import explore
from hdopt.workflow.stack import drive_problem_of

AGREEMENT_ARCMIN = 1e-3
"""What the explorer promises; found are 1e-6, the rounding of the kept reference."""
LARGEST_BYTES = 6e6
FRAMES_PER_SECOND = 30
ATTEMPTS = 6
"""Other work on the machine only takes frames away, so the best of a few runs counts."""


DRIVES = 256
"""Of the cloud: fewer than usual, for the tests have other things to wait for."""
MOST_TABS = 60
"""Steps with the Tab key that pass every control once."""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("explorer") / "explorer.html"
    explore("csf-25-80", file, DRIVES)
    return file


@pytest.fixture
def page(browser: Chromium, page_file):
    with browser.open(page_file) as opened:
        yield opened
        assert opened.errors == []
        assert opened.requests == []


def computed(page, settings, body):
    """What the script `body`, a function of a drive and its setting, says of each of the `settings`."""
    gears = [reference.script_gear(index) for index in range(len(reference.GEARS))]
    return page.evaluate(
        f"""(() => {{ const gears = {json.dumps(gears)}, F = HdoptClosedForm, body = {body};
        const of = (one) => body(F.drive(gears[one.gear], one, one.errors), gears[one.gear]);
        return {json.dumps(settings)}.map(of); }})()"""
    )


def test_the_kept_reference_is_still_what_python_says():
    kept = np.load(reference.FILE)
    assert len(kept) == reference.COUNT
    for index in range(0, reference.COUNT, 250):
        # single precision keeps 7 digits of a few arcmin
        assert reference.peak_to_peak(reference.setting(index)) == pytest.approx(float(kept[index]), abs=2e-6)


@pytest.mark.slow
def test_the_peak_to_peak_is_pythons_at_10000_settings(page):
    """Catches a wrong sign, a lost term or a pruned extreme in any structure, profile or gear."""
    kept = np.load(reference.FILE)
    found = []
    for start in range(0, reference.COUNT, 1000):
        settings = [reference.setting(index) for index in range(start, start + 1000)]
        found += computed(page, settings, "F.peakToPeak")
    worst = np.abs(np.array(found) - kept).max()
    assert worst < AGREEMENT_ARCMIN
    # far closer than promised: a term of third order that went missing would show
    assert worst < 5e-6


SOME = [reference.setting(index) for index in range(0, 480, 10)]


def test_the_carpet_is_pythons_waveform(page):
    places = 45
    rows = computed(page, SOME, f"(it) => Array.from(F.carpet(it, {places}))")
    for one, row in zip(SOME, rows, strict=True):
        drive = reference.drive(one)
        theta = np.arange(drive.geometry.beat_phases * places) * (2 * math.pi / places)
        expected = kinematic_error_arcmin(drive, reference.errors(one), theta, CLOSED_FORM)
        # the carpet is kept in single precision; where two rims tie, either may be taken
        assert np.quantile(np.abs(np.array(row) - expected), 0.999) < 2e-6


def test_orders_contact_and_bending_are_pythons(page):
    places = 90
    for one in SOME[:12]:
        drive = reference.drive(one)
        orders = [order.order for order in model_orders(drive.geometry.ratio)]
        (found,) = computed(
            page,
            [one],
            f"""(it, gear) => ({{
              amplitudes: F.amplitudesAt(it.phases, {places}, {orders})(F.carpet(it, {places})),
              contact: F.contact(gear, it.profile), bending: F.bending(gear, it.profile) }})""",
        )
        theta, error = relative_turn(drive, reference.errors(one), places, CLOSED_FORM)
        expected = order_spectrum(theta, error, orders).amplitudes
        assert found["amplitudes"] == pytest.approx(expected, abs=1e-6)
        profile = drive.wave_generator.profile
        assert found["contact"]["angle"] == pytest.approx(contact_angle(drive.geometry, profile), abs=1e-9)
        assert found["bending"]["change"] == pytest.approx(max_curvature_change(drive.geometry, profile), rel=1e-9)


def closed_form_arcmin(study):
    return converged_peak_to_peak_arcmin(study.drive, study.errors, CLOSED_FORM)


def test_the_page_opens_at_the_study(page, page_file):
    study = load_study("csf-25-80")
    assert page_file.stat().st_size < LARGEST_BYTES
    assert page.evaluate("hdoptExplorer.found().peakToPeak") == pytest.approx(closed_form_arcmin(study), abs=1e-6)
    assert page.evaluate("hdoptExplorer.hash()") == ""
    assert "missed: 0.369 above 1" in page.evaluate("document.getElementById('figures').textContent")


POINT = {
    "profile": "two_disk",
    "structure": "one_way_minor",
    "wrap_angle_deg": 42.5,
    "pressure_angle_deg": 17.3,
    "width_mm": 7.2,
    "axis_eccentricity_mm": 0.0234,
    "axis_tilt_x_deg": -0.31,
    "fs_tooth_phase_deg": 77,
}


def go_to(page, hash):
    page.evaluate(f"location.hash = {json.dumps(hash)}")
    page.wait(0.05)
    return page.evaluate("hdoptExplorer.settled().then((found) => found.peakToPeak)")


def test_a_point_comes_out_as_it_went_in(page, tmp_path):
    """By address, as a study file and as a command line, the same drive to the last digit shown."""
    shown = go_to(page, "&".join(f"{key}={value}" for key, value in POINT.items()))
    (tmp_path / "point.toml").write_text(page.evaluate("hdoptExplorer.toml()"))
    words = shlex.split(page.evaluate("hdoptExplorer.settings()"))
    assert words[:3] == ["hdopt", "ke", "csf-25-80"]
    overrides = [word for word in words[3:] if word != "--set"]
    for study in (load_study(tmp_path / "point.toml"), load_study("csf-25-80", overrides)):
        assert closed_form_arcmin(study) == pytest.approx(shown, abs=1e-6)
        for section in ("drive", "wave_generator", "errors"):
            for key in POINT.keys() & study.data[section].keys():
                assert study.data[section][key] == POINT[key]
    page.wait(0.4)
    assert page.evaluate("location.hash.slice(1) === hdoptExplorer.hash()")
    assert set(page.evaluate("hdoptExplorer.hash()").split("&")) == {f"{key}={value}" for key, value in POINT.items()}


@pytest.mark.parametrize(
    ("hash", "said"),
    [
        ("foo=3", "“foo” is no value of this page"),
        ("axis_eccentricity_mm=9", "Axis eccentricity cannot be 9 mm here: this page goes from 0 to 0.045 mm"),
        ("axis_eccentricity_mm=-0.001", "cannot be -0.001 mm here"),
        ("width_mm=wide", "Width cannot be “wide”: give a number in mm, such as 9"),
        ("width_mm", "Width cannot be “”: give a number in mm"),
        ("structure=loose", "take one of integral, automatic, one_way_major, one_way_minor"),
        ("%E0%A4%A", "“%E0%A4%A” cannot be read"),
        ("&".join(f"x{i}=1" for i in range(9)), "and 5 more"),
    ],
)
def test_an_address_that_cannot_be_taken_gets_a_plain_message(page, hash, said):
    shown = go_to(page, hash)
    assert said in page.evaluate("document.querySelector('#message:not([hidden])').textContent")
    assert shown == pytest.approx(closed_form_arcmin(load_study("csf-25-80")), abs=1e-6)


def typed(page, key, text):
    page.evaluate(
        f"(() => {{ const box = document.getElementById('in-{key}-number'); box.value = {json.dumps(text)};"
        " box.dispatchEvent(new Event('change')); })()"
    )
    return page.evaluate(f"hdoptExplorer.value().{key}")


def test_a_number_may_be_typed_and_one_out_of_range_is_refused(page):
    assert typed(page, "axis_eccentricity_mm", "0,0123") == 0.0123
    assert typed(page, "axis_eccentricity_mm", "12") == 0.0123
    assert "cannot be 12 mm here" in page.evaluate("document.querySelector('#message:not([hidden])').textContent")
    assert page.evaluate("document.getElementById('in-axis_eccentricity_mm-number').ariaInvalid") == "true"


def press(page, key, code):
    for kind in ("rawKeyDown", "keyUp"):
        page._call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)


def test_every_control_is_reached_by_keyboard_and_arrows_move_a_slider(page):
    reached = set()
    for _ in range(MOST_TABS):
        press(page, "Tab", 9)
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.ariaLabel || ''"))
    controls = "'#controls input:enabled, #controls select'"
    inputs = page.evaluate(f"[...document.querySelectorAll({controls})].map((one) => one.id)")
    assert len(inputs) >= 2 * 14 + 2
    assert {*inputs, "turn", "against", "copy-toml", "copy-set", "copy-link", "theme"} <= reached
    page.evaluate("document.getElementById('in-axis_eccentricity_mm').focus()")
    press(page, "ArrowRight", 39)
    assert page.evaluate("hdoptExplorer.value().axis_eccentricity_mm") == pytest.approx(0.0101)


def test_the_cloud_of_a_changed_design_is_the_stack_of_that_design(page):
    go_to(page, "width_mm=6&structure=automatic")
    study = load_study("csf-25-80", ["width_mm=6", "structure=automatic"])
    data = page.evaluate("hdoptExplorer.data.cloud.errors")
    assert len(data) == DRIVES
    rows = np.array(data)
    response = drive_problem_of(study).response
    for column, name in enumerate(vars(response.held)):
        if study_key(name).endswith("_deg"):
            rows[:, column] = np.radians(rows[:, column])
    expected = np.mean(matrix_peak_to_peak_arcmin(study.drive, rows) <= 1.0)
    said = page.evaluate("document.getElementById('figures').textContent")
    assert f"{100 * expected:.4g} %" in said.replace("\u2212", "-"), said


def test_a_yield_is_met_only_where_so_few_drives_can_tell(page):
    """SciPy's interval; of 256 drives none can meet 99.73 %. Fault caught: green at 99.8 % of 512, where a stack of
    8192 misses with 99.15 %."""
    for kept, count in ((256, 256), (250, 256), (1, 256), (0, 7), (2031, 2048)):
        ends = scipy.stats.binomtest(kept, count).proportion_ci(method="wilson")
        assert page.evaluate(f"HdoptCharts.shareOf({kept}, {count})") == pytest.approx(list(ends), abs=1e-7)
    go_to(page, "pressure_angle_deg=30&width_mm=3")
    assert "needs 99.73 %: missed" in page.evaluate("document.getElementById('figures').textContent")
    go_to(page, "width_mm=9")
    assert "needs 99.73 %: not decided" in page.evaluate("document.getElementById('figures').textContent")


@pytest.mark.parametrize("size", [(390, 844), (1280, 720), (1920, 1080)])
def test_nothing_is_wider_than_the_screen_and_all_views_are_drawn(browser, page_file, size):
    with browser.open(page_file, size) as page:
        assert page.evaluate("look.overflow()") == []
        blank = """[...document.querySelectorAll('.view canvas')].filter((canvas) => {
          const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
          return canvas.clientHeight < 60 || !pixels.some((value) => value);
        }).map((canvas) => canvas.parentElement.className)"""
        assert page.evaluate(blank) == []
        if size[0] > 1088:  # side by side: a projector's 720 lines show all of it
            assert page.evaluate("document.documentElement.scrollHeight") <= size[1]
        assert page.errors == []


TEXTS = """(() => {
  const kept = [], draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const { width, actualBoundingBoxAscent: up, actualBoundingBoxDescent: down, actualBoundingBoxLeft: left } =
      this.measureText(text);
    if (!this.getTransform().b) {  // what is turned stands beside an axis
      kept.push([this.canvas.parentElement.className, text, x - left, y - up, x - left + width, y + down]);
    }
    draw.apply(this, arguments);
  };
  document.getElementById("theme").click();
  return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(kept))));
})()"""
"""Every level text of the views, drawn anew: its view, its words, and its box."""


@pytest.mark.parametrize("size", [(390, 844), (800, 1600), (1400, 1600), (1920, 1080)])
def test_no_two_texts_of_a_view_read_as_one(browser, page_file, size):
    """On one line they stand three quarters of a character's height apart at least. Fault caught: the colour bar's unit
    beside the last tick of the angle, "360 arcmin"."""
    with browser.open(page_file, size) as page:
        texts = page.evaluate(TEXTS)
    assert {view.split()[-1] for view, *_ in texts} == set("waveform cloud carpet orders contact bending".split())
    assert [text for _, text, *_ in texts].count("arcmin") == 1
    apart = 0.75 * (14 if size[0] > 1760 else 11)
    for (view, one, *a), (other_view, other, *b) in itertools.combinations(texts, 2):
        on_one_line = min(a[3], b[3]) > max(a[1], b[1])
        if view == other_view and on_one_line:
            assert max(a[0], b[0]) - min(a[2], b[2]) >= apart, f"{view}: {one!r} beside {other!r}"


@pytest.mark.parametrize("size", [(390, 844), (1280, 900)])
def test_a_slider_is_followed_at_30_frames_a_second(browser, page_file, size):
    """Measured in the page. Where other work has the processors, the processor time of a frame counts instead."""
    frames = 60
    with browser.open(page_file, size) as page:
        rates, costs = [], []
        while not rates or (max(rates) < FRAMES_PER_SECOND and len(rates) < ATTEMPTS):
            before = page.cpu_seconds()
            rates.append(page.evaluate(f"hdoptExplorer.measure('axis_eccentricity_mm', {frames})")["frames_per_second"])
            costs.append((page.cpu_seconds() - before) / frames)
        busy = os.getloadavg()[0] > os.cpu_count()
        assert max(rates) >= FRAMES_PER_SECOND or (busy and min(costs) < 1 / FRAMES_PER_SECOND), (rates, costs)


def test_both_themes_can_be_read(page):
    """Text stands out from its ground by at least 4.5 to 1 (WCAG 2.1, 1.4.3) in the light and in the dark."""
    for _ in range(2):
        ratios = page.evaluate(
            """(() => {
              const style = getComputedStyle(document.documentElement);
              const light = (name) => {
                const hex = style.getPropertyValue(name).trim();
                const part = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255)
                  .map((c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
                return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
              };
              const paper = light('--paper');
              return ['--ink', '--muted', '--good', '--bad', '--accent'].map((name) => {
                const own = light(name);
                return (Math.max(own, paper) + 0.05) / (Math.min(own, paper) + 0.05);
              });
            })()"""
        )
        assert min(ratios) >= 4.5
        page.evaluate("document.getElementById('theme').click()")
