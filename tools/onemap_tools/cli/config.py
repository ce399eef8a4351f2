"""``onemap config``: show, check and explain the configuration."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json, result_console

app = typer.Typer(no_args_is_help=True, help="Show, check and explain the configuration.")


@app.command()
def show(config: Config = None, as_json: Json = False) -> None:
    """The values that take effect, as YAML: defaults, then the file, then the environment.

    The environment overrides a key by a variable ONEMAP__SECTION__KEY. Secrets are masked.
    """
    import yaml

    from onemap_tools.cli.config_report import effective, installed_models

    models = installed_models()
    sections = effective(config, models)
    if as_json:
        print_json(sections)
        return
    for name, reason in models.missing.items():
        typer.echo(f"# {name} is left out. {reason}")
    typer.echo(yaml.safe_dump(sections, sort_keys=False, allow_unicode=True), nl=False)


@app.command()
def check(config: Config = None, as_json: Json = False) -> None:
    """Check every section: OK, or one sentence for each mistake and exit code 2."""
    from onemap_tools.cli import config_report

    models = config_report.installed_models()
    config_report.check(config, models)
    console = result_console(as_json)
    for name, reason in models.missing.items():
        console.print(f"{name} is not checked here. {reason}", soft_wrap=True)
    console.print("OK")
    if as_json:
        print_json({"ok": True, "checked": list(models.known), "not_checked": dict(models.missing)})


@app.command()
def schema(
    section: Annotated[str, typer.Argument(help="Only this one, for example mapper.")] = "",
    as_json: Json = False,
) -> None:
    """Every key with its type, limits, default, unit and reason; with --json as a JSON schema."""
    from onemap_tools.cli import config_report

    models = config_report.select(section, config_report.installed_models())
    document = config_report.schema(models)
    if as_json:
        print_json(document)
        return
    console = result_console(as_json)
    for name, reason in models.missing.items():
        console.print(f"{name} is left out. {reason}", soft_wrap=True)
    for line in config_report.SchemaText(document).lines():
        console.print(line, soft_wrap=True)
