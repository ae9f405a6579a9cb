"""A film has a picture for every moment, with the time and the activations beside it."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from opspace.errors import InputError, MissingExtraError
from opspace.pictures.film import BAND, film
from opspace.pictures.movie_file import write_mp4
from opspace.pictures.offscreen import SnapshotUnavailableError
from opspace.robots import load_robot

SIZE = (120, 90)


@pytest.mark.usefixtures("opengl")
def test_a_film_has_a_picture_for_every_moment(run, tmp_path):
    robot = load_robot("puma560")
    path = film(run, robot, tmp_path / "new" / "run.gif", fps=4.0, speed=2.0, size=SIZE)
    with Image.open(path) as moving:
        seconds = float(run.t[-1] - run.t[0])
        assert moving.n_frames == int(np.ceil(seconds / 2.0 * 4.0))
        assert moving.size == (SIZE[0] + BAND, SIZE[1])
        assert moving.info["duration"] == 250
        first = np.asarray(moving.convert("RGB")).astype(int)
        moving.seek(moving.n_frames // 2)
        middle = np.asarray(moving.convert("RGB")).astype(int)
    assert np.abs(first[:, BAND:] - middle[:, BAND:]).mean() > 1.0
    assert np.abs(first[:20, :BAND] - middle[:20, :BAND]).max() > 50  # the time


@pytest.mark.usefixtures("opengl")
def test_an_mp4_has_the_pictures_of_the_gif(run, tmp_path):
    """An odd size, which H.264 itself cannot hold, gets a line of white."""
    options = {"fps": 2.0, "speed": 2.0, "size": (SIZE[0] + 1, SIZE[1] + 1)}
    paths = [tmp_path / "run.gif", tmp_path / "run.mp4"]
    told = []
    for path in paths:
        film(run, load_robot("puma560"), path, progress=lambda *n: told.append(n), **options)
    with Image.open(paths[0]) as moving:
        count, (width, height) = moving.n_frames, moving.size
        expected = [np.asarray(moving.convert("RGB")) for i in range(count) if not moving.seek(i)]
    assert (width % 2, height % 2) == (1, 1)
    said, frames = decoded(paths[1], (width + 1, height + 1))
    for word in ("h264", "yuv420p", f"{width + 1}x{height + 1}", "2 fps"):
        assert word in said
    assert told == [(i, count) for i in range(1, count + 1)] * 2
    assert len(frames) == count
    for frame, picture in zip(frames, expected, strict=True):
        assert frame.std() > 20.0
        assert np.abs(frame[:height, :width].astype(float) - picture).mean() < 6.0
    changed = [np.abs(frames[0].astype(float) - frame).mean() for frame in frames]
    assert max(changed) > 2.0
    assert b"moov" in paths[1].read_bytes()[:4096]  # players need not read to the end to begin


def decoded(path, size):
    """What ffmpeg says of a film, and its pictures."""
    import imageio_ffmpeg

    words = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path)]
    words += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(words, capture_output=True, check=True)
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, *size[::-1], 3)
    return done.stderr.decode().split("Output")[0], pictures


def test_a_film_that_fails_leaves_what_was_there(run, tmp_path, monkeypatch):
    """The third picture cannot be rendered."""

    def two_pictures(*_, size, **__):
        yield from np.zeros((2, *size[::-1], 3), np.uint8)
        raise SnapshotUnavailableError("no more")

    monkeypatch.setattr("opspace.pictures.film.render", two_pictures)
    for name in ("run.gif", "run.mp4"):
        path = tmp_path / name
        path.write_text("old")
        with pytest.raises(SnapshotUnavailableError, match="no more"):
            film(run, load_robot("puma560"), path, size=SIZE)
        assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 2


def pictures(count):
    return iter([Image.new("RGB", SIZE, (i, 0, 0)) for i in range(count)])


def test_pictures_that_ffmpeg_loses_are_noticed(tmp_path, monkeypatch):
    import imageio_ffmpeg

    count = imageio_ffmpeg.count_frames_and_secs
    monkeypatch.setattr(imageio_ffmpeg, "count_frames_and_secs", lambda p: (count(p)[0] - 1, 0.0))
    with pytest.raises(OSError, match="wrote 4 of 5 pictures"):
        write_mp4(pictures(5), tmp_path / "run.mp4", 10.0)


def test_a_run_of_one_moment_is_a_film_of_one_picture(run, tmp_path, monkeypatch):
    moment = dataclasses.replace(run, data=run.data[:1])
    monkeypatch.setattr(
        "opspace.pictures.film.render",
        lambda *_, size, **__: iter(np.zeros((1, *size, 3), np.uint8)),
    )
    with Image.open(film(moment, load_robot("puma560"), tmp_path / "run.gif")) as picture:
        assert getattr(picture, "n_frames", 1) == 1


def test_what_writes_mp4_is_named_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match=r"imageio-ffmpeg .* 'opspace\[export\]'"):
        write_mp4(pictures(1), tmp_path / "run.mp4", 10.0)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("run.avi", {}, r"ends in \.gif or \.mp4"),
        ("run.gif", {"fps": 0.0}, "fps must be"),
        ("run.gif", {"speed": float("nan")}, "speed must be"),
    ],
)
def test_bad_requests_are_refused(run, tmp_path, name, options, message):
    with pytest.raises(InputError, match=message):
        film(run, load_robot("puma560"), tmp_path / name, **options)
