"""`artigrasp render`: pictures of objects and references, pictures and videos of motions."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar


@dataclass(frozen=True)
class References:
    """Write a contact sheet of references, seen from where the hands are seen best; red links should touch.

    Only the hands that take part are shown. A reference's number is that of `--indices` and of `artigrasp generate
    --reference`, which counts within a split and a kind.

    With --json: {"path": file, "references": {object: how many are shown}}.
    """

    objects: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Objects whose references to show."""
    split: str | None = None
    """Only those of this split, as `artigrasp list references` names it."""
    kind: Literal["articulate", "grasp"] | None = None
    """Only those of this kind."""
    indices: tuple[int, ...] = ()
    """Out of what then remains of each object, only these."""
    out: Path = Path("references.png")
    """Image to write: .png, .jpg or .webp."""
    size: int = 200
    """Width and height of a picture [px]."""
    views: int = 2
    """Pictures of each reference: 1, or 2, of which the second is from another side and nearer the hands."""
    links: bool = False
    """Show hands as the rigid links that collide, without skin."""
    columns: int | None = None
    """References in a row; by default such that the sheet is a little wider than high."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Objects:
    """Write a contact sheet of objects, closed, half open and open.

    With --json: {"path": file, "objects": [name]}.
    """

    objects: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Objects to show."""
    out: Path = Path("objects.png")
    """Image to write: .png, .jpg or .webp."""
    openings: tuple[float, ...] = (0.0, 0.5, 1.0)
    """Hinge angles to show, as a share of the whole range."""
    size: int = 240
    """Width and height of a picture [px]."""
    columns: int | None = None
    """Objects in a row; by default such that the sheet is about square."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Motion:
    """Write a motion as a video, or as a contact sheet of the samples that tell most of it.

    Several motions are shown side by side in a video, and below each other in a contact sheet. Needs no display. The
    ending of the file to write decides: .mp4 and .gif are videos, .png and .jpg are contact
    sheets, and .webp is a video that can be transparent. Links of a hand turn red where they press on the object.

    With --json: {"path": file}.
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Motion files, as `artigrasp generate` writes them."""
    out: Path | None = None
    """File to write; by default beside the first motion, with the ending .mp4."""
    camera: Literal["three-quarter", "front", "side", "top", "orbit", "follow"] = "three-quarter"
    """Where the camera is; seen from the object, the hands are in front. "orbit" goes round once, "follow" keeps what
    moves in the middle."""
    width: int | None = None
    """Of a frame [px]; by default 640 in a video and 300 in a contact sheet."""
    height: int | None = None
    """Of a frame with its caption [px]; by default 480 in a video and 360 in a contact sheet."""
    fps: float = 30.0
    """Frames of a video per second."""
    frames: int = 5
    """Frames of a contact sheet; 1 is a picture of the last sample."""
    columns: int | None = None
    """Frames in a row of a contact sheet; all by default."""
    target: bool = False
    """Show a ghost of the object at its target, or of the articulated part at the target angle."""
    links: bool = False
    """Show hands as the rigid links that collide, without skin."""
    no_caption: bool = False
    """Leave out time, phase and hinge angle."""
    transparent: bool = False
    """Leave out the background, but for the shadow: .png and .webp only."""
    grid: int = 2
    """A pixel is the mean of so many by so many samples: 1 is quick, 3 is fine."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Options:
    """Render objects or references as a contact sheet, or a motion as a video or a contact sheet."""

    what: Annotated[
        Annotated[Objects, tyro.conf.subcommand("objects")]
        | Annotated[References, tyro.conf.subcommand("references")]
        | Annotated[Motion, tyro.conf.subcommand("motion")],
        tyro.conf.arg(name=""),
    ]


def run(options: Options) -> int:
    """Render what is asked for."""
    from artigrasp.cli.warp_start import start_warp

    start_warp()
    if isinstance(options.what, Objects):
        _render_objects(options.what)
    elif isinstance(options.what, References):
        _render_references(options.what)
    else:
        _render_motion(options.what)
    return 0


def _render_objects(options: Objects) -> None:
    from artigrasp.errors import UserError
    from artigrasp.export.object_sheet import render_objects

    if not options.objects:
        raise UserError("expected the names of one or more objects, found none")
    names = list(dict.fromkeys(options.objects))
    with progress_bar("Rendering", hidden=options.json) as progress:
        render_objects(
            names,
            options.out,
            openings=options.openings,
            size=options.size,
            columns=options.columns,
            progress=lambda done, total: progress("", done, total),
        )
    if options.json:
        show_json({"path": str(options.out), "objects": names})
    else:
        show(f"wrote {options.out}: {len(names)} objects")


def _render_references(options: References) -> None:
    from artigrasp.errors import UserError
    from artigrasp.export.reference_sheet import render_references
    from artigrasp.references.reference import load_references

    if not options.objects:
        raise UserError("expected the names of one or more objects, found none")
    sets = [
        load_references(name).select(split=options.split, kind=options.kind, indices=options.indices or None)
        for name in dict.fromkeys(options.objects)
    ]
    numbers = [options.indices or tuple(range(len(references))) for references in sets]
    words = [", ".join(references.object for references in sets), options.split, options.kind]
    with progress_bar("Rendering", hidden=options.json) as progress:
        render_references(
            sets,
            options.out,
            numbers=numbers,
            title="  ".join(word for word in words if word),
            size=options.size,
            views=options.views,
            links=options.links,
            columns=options.columns,
            progress=lambda done, total: progress("", done, total),
        )
    if options.json:
        counts = {references.object: len(references) for references in sets}
        show_json({"path": str(options.out), "references": counts})
    else:
        show(f"wrote {options.out}: {sum(map(len, sets))} references")


def _render_motion(options: Motion) -> None:
    from artigrasp.errors import UserError
    from artigrasp.export.image_file import MOVING_SUFFIXES
    from artigrasp.export.picture import Style, render_filmstrip, render_video
    from artigrasp.motion.file import load_motion

    if not options.files:
        raise UserError("expected one or more motion files, found none")
    path = options.out or options.files[0].with_suffix(".mp4")
    is_video = path.suffix.lower() in MOVING_SUFFIXES
    width, height = (640, 480) if is_video else (300, 360)
    style = Style(
        camera=options.camera,
        width=width if options.width is None else options.width,
        height=height if options.height is None else options.height,
        caption=not options.no_caption,
        target=options.target,
        links=options.links,
        transparent=options.transparent,
        grid=options.grid,
    )
    motions = [load_motion(file) for file in options.files]
    with progress_bar("Rendering", hidden=options.json) as progress:

        def show_progress(done: int, total: int) -> None:
            progress("", done, total)

        if is_video:
            render_video(motions, path, rate=options.fps, style=style, progress=show_progress)
        else:
            render_filmstrip(
                motions,
                path,
                frame_count=options.frames,
                columns=options.columns,
                style=style,
                progress=show_progress,
            )
    if options.json:
        show_json({"path": str(path)})
    else:
        show(f"wrote {path}")
