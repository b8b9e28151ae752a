"""The environment in which every page's template is rendered."""

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined


def environment_of(*packages: str) -> Environment:
    """An environment for the templates of these packages: it escapes every value and refuses undefined names."""
    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
