"""The registry of names that a scenario or command line can use.

Validation, command line, report and documentation look names up here. A class is imported when it is used. A registry
also has the entry points of installed packages, and accepts `module:Class` for any importable class and `file.py:Class`
for a class in a file in a folder of Python's path:

    [project.entry-points."airground_drake.policies"]
    orbit = "my_package.orbit:Orbit"
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from airground_drake.base.errors import PluginError, UnknownNameError, described
from airground_drake.base.files import sha256

T = TypeVar("T")

PLUGIN = "module:Class or file.py:Class"  # form of the name of a class that is not registered
_WORD = r"[^\W\d]\w*"
PLUGIN_PATTERN = rf"^({_WORD}(\.{_WORD})*|([\w-]+/)*[\w-]+\.py):{_WORD}$"  # this form as a regular expression


class Registry:
    """Classes of one kind by name: the package's own, entry points, and names of the form `PLUGIN`."""

    def __init__(self, kind: str, plural: str, own: Mapping[str, str]) -> None:
        """Declare the package's own classes.

        Args:
            kind: singular, for messages.
            plural: last part of the entry points' group, `airground_drake.<plural>`.
            own: `module:Class` by name, in the order of lists.
        """
        self.kind = kind
        self.group = f"airground_drake.{plural}"
        self._own = dict(own)
        self._added: dict[str, type] = {}

    def __iter__(self) -> Iterator[str]:
        """All registered names: the package's own, then those of entry points, sorted, then added ones."""
        yield from {**self._own, **dict.fromkeys(sorted(_entry_points(self.group))), **self._added}

    def __contains__(self, name: object) -> bool:
        return name in tuple(self)

    @property
    def own(self) -> tuple[str, ...]:
        """Names of the package's own classes."""
        return tuple(self._own)

    @property
    def others(self) -> Registry:
        """This registry without the package's own classes."""
        return Registry(self.kind, self.group.rpartition(".")[2], {})

    @property
    def allowed(self) -> tuple[str, ...]:
        """The registered names, and `PLUGIN`."""
        return (*self, PLUGIN)

    def accepts(self, name: str) -> bool:
        """Whether a name is registered or has the form of `PLUGIN`; nothing is imported."""
        return name in self or is_plugin(name)

    def is_foreign(self, name: str) -> bool:
        """Whether a name is third-party code: neither the package's own nor added in this process."""
        return name not in self._own and name not in self._added

    def says(self, name: str) -> str:
        """The `summary = "..."` of a registered class, else the first line of its docstring; '' if it has neither.

        Its module is read, not imported (packages above it are).
        """
        module, _, attribute = {**self._own, **_entry_points(self.group)}.get(name, "").partition(":")
        with suppress(Exception):  # an installed package may raise anything
            spec = importlib.util.find_spec(module)
            tree = ast.parse(Path(spec.origin or "").read_bytes() if spec else b"")
            (definition,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == attribute)
            statements = (node for node in definition.body if isinstance(node, ast.Assign))
            assigned = {ast.unparse(statement.targets[0]): statement.value for statement in statements}
            if summary := assigned.get("summary"):
                return str(ast.literal_eval(summary))
            return (ast.get_docstring(definition) or "").partition("\n")[0]
        return ""

    def load(self, name: str, of: type[T]) -> type[T]:
        """Import a class.

        Args:
            name: registered, `module:Class`, or `file.py:Class`.
            of: its base class, or a protocol that it must meet.

        Raises:
            UnknownNameError: if the name is not registered and not of the form of `PLUGIN`.
            PluginError: if it cannot be imported, or is no such class; names the folders that were searched.
        """
        value: object = self._added.get(name)
        if value is None:
            place = self._own.get(name) or _entry_points(self.group).get(name) or (name if is_plugin(name) else None)
            if place is None:
                raise UnknownNameError(self.kind, name, self.allowed)
            module, _, attribute = place.partition(":")
            try:
                value = getattr(_imported(module), attribute)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # a third-party module may raise anything when it is imported
                looked = f"; looked in {_places()}" if isinstance(error, ModuleNotFoundError) else ""
                raise PluginError(f"{self.kind} {name!r} cannot be imported: {described(error)}{looked}") from None
        if not (isinstance(value, type) and issubclass(value, of)):
            raise PluginError(f"{self.kind} {name!r} is not a subclass of {of.__module__}.{of.__qualname__}")
        return value

    def make(self, name: str, of: type[T], **parameters: Any) -> T:
        """Make an object of a class.

        Raises:
            UnknownNameError: as `load`.
            PluginError: as `load`, and if the class refuses these parameters; names the parameters that it takes.
        """
        kind = self.load(name, of)
        try:
            return kind(**parameters)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            why = misfit(kind, parameters) or described(error)
            raise PluginError(f"{self.kind} {name!r} with {parameters}: {why}") from None

    def misfit(self, name: str, parameters: Mapping[str, Any]) -> str:
        """Why the class refuses these parameters, and those that it takes; '' if it takes them, or is third-party."""
        return "" if self.is_foreign(name) else misfit(self.load(name, object), parameters)

    @contextmanager
    def adding(self, name: str, what: type) -> Iterator[None]:
        """Register a class under a name within a block (in a notebook, a benchmark or a test)."""
        before, self._added = self._added, {**self._added, name: what}
        try:
            yield
        finally:
            self._added = before


def misfit(make: Callable[..., object], parameters: Mapping[str, Any]) -> str:
    """Why a class or function refuses these parameters, and which it takes; '' if it accepts all, or is unknown."""
    try:
        signature = inspect.signature(make)
    except (TypeError, ValueError):
        return ""
    try:
        signature.bind(**parameters)
    except TypeError as error:
        given = (key for key in signature.parameters.values() if key.kind is not key.VAR_KEYWORD)
        takes = [f"{key.name} (needed)" if key.default is key.empty else key.name for key in given]
        return f"{error}; allowed: {', '.join(takes) or 'none'}"
    return ""


def parameters(kind: type) -> list[str]:
    """The parameters that a class takes by keyword, each with its default: `name`, or `name = value`."""
    keys = [key for key in inspect.signature(kind).parameters.values() if key.kind is key.KEYWORD_ONLY]
    return [key.name if key.default is key.empty else f"{key.name} = {key.default}" for key in keys]


def is_plugin(name: str) -> bool:
    """Whether a name has the form `module:Class` or `folders/file.py:Class`."""
    return re.fullmatch(PLUGIN_PATTERN, name) is not None


def source_of(place: str) -> Path | None:
    """The file of a class named as `module:Class` or `file.py:Class`, in a folder of Python's path, or None."""
    module = place.partition(":")[0]
    if module.endswith(".py"):
        return _on_path(module)
    inside = module.replace(".", "/")
    files = (Path(folder or ".", f"{inside}{end}") for folder in sys.path for end in (".py", "/__init__.py"))
    return next((file for file in files if file.is_file()), None)


def _imported(module: str) -> ModuleType:
    """Import a module by name, or a file in a folder of Python's path; the last folder is searched first."""
    if not module.endswith(".py"):
        return importlib.import_module(module)
    if (path := _on_path(module)) is None:
        raise ModuleNotFoundError(f"no file {module}")
    return _executed(path)


def _on_path(file: str) -> Path | None:
    """A file in a folder of Python's path; the last folder is searched first."""
    paths = (Path(folder or ".", file).resolve() for folder in reversed(sys.path))
    return next((path for path in paths if path.is_file()), None)


def _executed(path: Path) -> ModuleType:
    """Import a file under a unique module name."""
    name = f"{path.stem}_{sha256(str(path).encode())[:12]}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(sys.modules[name])
        except BaseException:
            del sys.modules[name]
            raise
    return sys.modules[name]


def _places() -> str:
    """A description of Python's path: added folders, the last one first, then Python's own."""
    own = tuple({sys.prefix, sys.base_prefix})
    added = [os.path.abspath(folder) for folder in reversed(sys.path) if not folder.startswith(own)]
    return ", ".join([*dict.fromkeys(added), "Python's own folders"])


@cache
def _entry_points(group: str) -> dict[str, str]:
    """`module:Class` by name, of all installed packages."""
    return {point.name: point.value for point in entry_points(group=group)}


@dataclass(frozen=True)
class Method:
    """A way to couple UAV and UGVs."""

    id: str  # as in scenario files
    says: str  # in words
    intervenes: bool  # whether the UAV makes proposals
    gated: bool  # whether the UGVs decide about proposals, by (21)-(29) or by outcomes
    intervention_on_top: bool  # priorities of (20); False: avoidance above the intervention


# The methods that are compared, by identifier: (a) to (c) are the paper's.
METHODS: dict[str, Method] = {
    method.id: method
    for method in (
        Method("a", "no intervention", intervenes=False, gated=False, intervention_on_top=True),
        Method("b", "direct intervention, no gatekeeper", intervenes=True, gated=False, intervention_on_top=True),
        Method("c", "MPC gatekeeper, (21)-(26)", intervenes=True, gated=True, intervention_on_top=True),
        Method("d", "avoidance on top, outcome gatekeeper", intervenes=True, gated=True, intervention_on_top=False),
    )
}


def method_of(name: str) -> Method:
    if name not in METHODS:
        raise UnknownNameError("method", name, METHODS)
    return METHODS[name]


# Intervention policies: subclasses of `uav.policy.Policy`.
POLICIES = Registry(
    "policy",
    "policies",
    {
        "detour": "airground_drake.uav.detour:Detour",
        "coordinate": "airground_drake.uav.coordinate:Coordinate",
        "towards": "airground_drake.uav.wrong:Towards",
        "stale_map": "airground_drake.uav.wrong:StaleMap",
        "noisy": "airground_drake.uav.wrong:Noisy",
        "hostile": "airground_drake.uav.wrong:Hostile",
        "agent": "airground_drake.uav.agent:Agent",
    },
)

# Ways to solve the gatekeeper's problem (26).
ROUTES = Registry(
    "route",
    "routes",
    {
        "mixed_integer": "airground_drake.ugv.routes.mixed_integer:MixedIntegerRoute",
        "relaxed": "airground_drake.ugv.routes.relaxed:RelaxedRoute",
        "nonlinear": "airground_drake.ugv.routes.nonlinear:NonlinearRoute",
    },
)

# Tasks of the UAV below obstacle avoidance: subclasses of `model.law.task.Task`.
UAV_TASKS = Registry("task", "uav_tasks", {"formation": "airground_drake.model.law.tasks:FormationTask"})

# Plants of robots: keys of a scenario in a file of that name, subclasses of `model.plants.plant.Keys`; and subclasses
# of Drake's System.
PLANTS = Registry(
    "plant",
    "plants",
    {
        place.rpartition(".")[2].partition(":")[0]: place
        for place in (
            "airground_drake.model.plants.first_order:FirstOrderKeys",
            "airground_drake.model.plants.unicycle:UnicycleKeys",
            "airground_drake.model.plants.ackermann:AckermannKeys",
            "airground_drake.model.plants.lag:LagKeys",
            "airground_drake.model.plants.delay:DelayKeys",
        )
    },
)

AS_TOLD = PLANTS.own[0]  # the default plant, which follows commands exactly

# Controllers of the UGVs in place of the package's own: subclasses of Drake's System.
UGV_CONTROLLERS = Registry("controller", "ugv_controllers", {})

# Samplers of points in the search for violations: classes that meet `study.campaign.search.Sampler`.
SAMPLERS = Registry(
    "sampler",
    "samplers",
    {
        "cma": "airground_drake.study.campaign.search:CmaEs",
        "halton": "airground_drake.study.campaign.search:Halton",
        "random": "airground_drake.study.campaign.search:Uniform",
    },
)


def _claims(identifiers: str) -> dict[str, str]:
    """The class of each claim: SAFE-TRACE is `SafeTrace` in safe_trace.py."""
    place = "airground_drake.verify.claims.{}:{}"
    return {
        claim: place.format(claim.lower().replace("-", "_"), claim.title().replace("-", ""))
        for claim in identifiers.split()
    }


# Claims about one run, in the order of the report: subclasses of `verify.claim.TraceClaim`.
RUN_CLAIMS = Registry(
    "claim",
    "run_claims",
    _claims("SAFE-TRACE SAFE-OWN SAFE-HYP ZENO-TRACE THR-TRIG THR-QUALITY GATE-PLAN LIVE-HYP LIVE-GOAL"),
)

DISTANCES = "SAFE-TRACE"  # the claim that all distances were kept, which `airground prove` also asks Coq about
ARRIVAL = "LIVE-GOAL"  # the claim that every robot ends where it must

# Claims about the model, in the order of the report: subclasses of `verify.claim.ModelClaim`.
MODEL_CLAIMS = Registry(
    "claim",
    "model_claims",
    _claims(
        "SAFE-INV SAFE-BUDGET SAFE-GATE SAFE-DIST ZENO-PROOF ZENO-REFINE LIVE-GATE LIVE-WAIT THR-ROOT THR-OPT "
        "THR-CHOICE THR-DDM"
    ),
)
