"""Options of the commands that measure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench.navigation.choices import Apartments, Errors, Features, Method, ObjectOrder

FeaturesOption = Annotated[
    Features, typer.Option(help="uncalibrated: simulated, with scores as CLIP's.")
]
SimulatedErrors = Annotated[
    Errors, typer.Option(help="Of a real robot; jump: drift that loop closures set right.")
]
Stairwells = Annotated[
    int,
    typer.Option(min=0, max=4, help="Openings in each apartment's floor, on the ways to take."),
]
Beside = Annotated[
    list[Path] | None,
    typer.Option(help="Results of another method, or of other settings, to compare with."),
]
SceneOrRecording = Annotated[
    Path,
    typer.Argument(
        exists=True,
        help="A GLB, glTF, OBJ or PLY file; or a recording: a folder with frames.json, or an "
        "MCAP file of 'onemap record' or of ROS 2.",
    ),
]
Order = Annotated[ObjectOrder, typer.Option(help="Of the objects: as drawn, or the cheapest.")]
Parity = Annotated[Apartments, typer.Option(help="Settings are chosen on even seeds.")]
SceneOut = Annotated[
    Path | None,
    typer.Option(file_okay=False, help="Write scene.json, scene.png and a map for each name here."),
]
Frames = Annotated[int, typer.Option(min=1, help="Frames to measure.")]
Threads = Annotated[int, typer.Option(min=1, help="CPU threads of torch.")]
MethodOption = Annotated[Method, typer.Option(help="Of searching.")]
ObjectsPerEpisode = Annotated[
    int, typer.Option(min=1, max=10, help="Objects, one after the other.")
]
ResultsFolder = Annotated[
    Path | None, typer.Option(help="Folder of the results; a killed run goes on there.")
]
Labels = Annotated[
    Path | None,
    typer.Option(
        exists=True,
        dir_okay=False,
        help="YAML: a list of name, x, y, radius_m; an empty list asks for nothing.",
    ),
]
Places = Annotated[int, typer.Option(min=1, max=100, help="From which a scene file is looked at.")]
