"""Pictures of a recording without a display: the viewer runs headless and is asked for frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from .exit_codes import CliError
from .folders import new_folder
from .viewer import headless_viewer

_FRAME_RATE = 10  # frames a second of simulated time, as images are recorded
_START_TIME = 30.0  # s
_CURE = "on Debian: apt-get install mesa-vulkan-drivers (a graphics driver in software)"


def export(paths: Sequence[Path], duration: float, target: Path, tick: Callable[[], None]) -> Path:
    """Write frames of recordings, shown together, as a video or as pictures.

    Args:
        paths: Recordings; a viewer that gets several shows the first, with a list of the others.
        duration: Of the longest of them [s].
        target: "*.mp4", or a folder to make.
        tick: Called after each frame.

    Returns:
        What was written.

    Raises:
        CliError: If the viewer cannot draw, the target exists, or its type is not known.
    """
    if target.suffix not in ("", ".mp4"):
        raise CliError(f"{target}: expected *.mp4, or the name of a folder")
    if target.suffix and target.exists():
        raise CliError(f"{target} exists: give another name")
    times = frame_times(duration)
    frames = _frames(paths, times, tick)
    return _write_video(target, frames) if target.suffix else _write_pictures(target, frames)


def frame_times(duration: float) -> list[float]:
    """Simulated time of each frame [s]."""
    return [k / _FRAME_RATE for k in range(int(duration * _FRAME_RATE) + 1)]


def _frames(
    paths: Sequence[Path], times: Sequence[float], tick: Callable[[], None]
) -> Iterator[bytes]:
    """PNG of each moment."""
    from horf_env.recording.names import TIME_TIMELINE

    with headless_viewer() as url:
        client = _connected(url)
        try:
            client.open([str(path.resolve()) for path in paths])
            client.set_time(TIME_TIMELINE, duration=times[0], play_state="paused")
            _rest(client)
            for moment in times:
                client.set_time(TIME_TIMELINE, duration=moment, play_state="paused")
                yield client.take_screenshot()
                tick()
        except RuntimeError as error:
            raise CliError(f"the viewer draws nothing ({error}); {_CURE}") from error


def _connected(url: str) -> Any:
    from rerun.experimental import ViewerClient

    end = time.monotonic() + _START_TIME
    while time.monotonic() < end:
        with suppress(Exception):  # whatever it raises while the viewer starts
            client = ViewerClient.connect(url)
            client.get_state()
            return client
        time.sleep(0.2)
    raise CliError(f"the headless viewer does not answer; {_CURE}")


def _rest(client: Any) -> None:
    """Wait until the viewer shows all that it was given: until two pictures are the same."""
    before, end = b"", time.monotonic() + _START_TIME
    while (now := client.take_screenshot()) != before:
        if time.monotonic() > end:
            raise CliError(f"the viewer still loads after {_START_TIME:g} s; export fewer at once")
        before = now


def _write_pictures(target: Path, frames: Iterator[bytes]) -> Path:
    folder = new_folder(target)
    for number, png in enumerate(frames):
        (folder / f"{number:05d}.png").write_bytes(png)
    return folder


def _write_video(target: Path, frames: Iterator[bytes]) -> Path:
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise CliError('no video encoder here: pip install "horf[video]"') from error
    unfinished = target.with_name(f".{target.stem}.part.mp4")
    first = _pixels(next(frames))
    height, width = first.shape[:2]
    writer = imageio_ffmpeg.write_frames(
        str(unfinished), (width, height), fps=_FRAME_RATE, macro_block_size=2
    )
    writer.send(None)
    with _closing(writer):
        writer.send(first.tobytes())
        for png in frames:
            writer.send(_pixels(png).tobytes())
    unfinished.replace(target)
    return target


@contextmanager
def _closing(writer: Any) -> Iterator[None]:
    try:
        yield
    finally:
        writer.close()


def _pixels(png: bytes) -> np.ndarray:
    """RGB, shape (H, W, 3), with even H and W, as encoders want them."""
    import io

    from PIL import Image

    image = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return np.ascontiguousarray(image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2])
