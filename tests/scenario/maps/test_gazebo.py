"""Gazebo worlds: shapes in frames within frames; hostile files."""

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.maps import gazebo

SMALL = st.floats(-20.0, 20.0)
POSES = st.tuples(SMALL, SMALL, SMALL, st.floats(-4.0, 4.0))
CYLINDER = "<cylinder><radius>0.075</radius><length>1</length></cylinder>"


def pose(place: tuple[float, ...]) -> str:
    x, y, z, heading = place
    return f"<pose frame=''>{x!r} {y!r} {z!r} 0 -0 {heading!r}</pose>"


def model(geometry: str, *places: tuple[float, ...], name: str = "pillar", more: str = "") -> str:
    """A model with a shape, at the poses of model, link and collision."""
    own, link, collision = ("" if place == () else pose(place) for place in (*places, (), (), ())[:3])
    inner = f"<collision name='c'>{collision}<geometry>{geometry}</geometry></collision>"
    return f"<model name='{name}'>{own}<static>1</static><link name='l'>{link}{inner}</link>{more}</model>"


def world(inner: str) -> gazebo.Gazebo:
    return gazebo.world(f"<?xml version='1.0'?>\n<sdf version='1.6'>\n<world name='w'>{inner}</world></sdf>", "w.world")


@given(places=st.lists(POSES, min_size=3, max_size=3), state=st.one_of(st.none(), POSES))
def test_frames_are_within_frames_and_the_state_moves_a_model(
    places: list[tuple[float, ...]], state: tuple[float, ...] | None
) -> None:
    text = model("<box><size>1 2 3</size></box>", *places)
    if state is not None:
        text += f"<state world_name='w'><model name='pillar'>{pose(state)}</model></state>"
    frames = [state or places[0], *places[1:]]
    if (due := sum(each[2] for each in frames) + 1.5) <= 1e-9:  # by rounding it may be at the ground, too
        assert due > -1e-9 or world(text) == ([], ["pillar, whose top is not above the ground"])
        return
    ((name, found, size, bottom, top),) = world(text).solids
    place, turned = 0j, 1 + 0j
    for x, y, _, heading in frames:
        place += turned * complex(x, y)
        turned *= cmath.exp(1j * heading)
    assert complex(found.x, found.y) == pytest.approx(place, abs=1e-12 * 60)
    assert cmath.exp(1j * found.heading) == pytest.approx(turned, abs=1e-12)
    assert (name, size) == ("pillar", (1.0, 2.0))
    assert (bottom, top) == pytest.approx((due - 3.0, due))


def test_headings_in_degrees_are_read_as_such() -> None:
    text = model("<box><size>1 2 3</size></box>", (1.0, 2.0, 0.5, 45.0)).replace("<pose", "<pose degrees='true'")
    assert world(text).solids[0].pose.heading == pytest.approx(0.25 * math.pi)


def test_cylinders_spheres_and_boxes_are_read_and_the_rest_is_named() -> None:
    text = (
        model(CYLINDER, (1.0, 2.0, 0.5, 0.3), name="a")
        + model("<sphere><radius>2</radius></sphere>", (0.0, 0.0, 1.0, 0.0), name="b")
        + model("<plane><normal>0 0 1</normal><size>100 100</size></plane>", name="ground")
        + model("<mesh><uri>x.dae</uri></mesh>", name="c", more=model(CYLINDER, name="inner"))
        + "<model name='walker'><plugin name='p' filename='p.so'/><link/></model>"
        + "<include><uri>model://sun</uri></include>"
        + "<state world_name='w'><model name='a'><scale>2 2 3</scale></model></state>"
    )
    found = world(text)
    assert [(each.name, each.size, each.top) for each in found.solids] == [("a", (0.15,), 2.0), ("b", (2.0,), 3.0)]
    assert found.solids[0].pose[:2] == (1.0, 2.0)
    assert found.left_out == [
        "<include> of model://sun", "a mesh of c", "inner within c", "walker, which a plug-in moves",
    ]  # fmt: skip


LEFT_OUT = {
    "<actor name='walker'><skin/></actor>": "<actor> walker",
    f"<population name='cans'>{model(CYLINDER)}</population>": "<population> cans",
    "<include><uri>model://house</uri><name>home</name></include>": "<include> of model://house as home",
    model(CYLINDER, more="<include><uri>model://shelf</uri></include>"): "<include> of model://shelf within pillar",
    model(CYLINDER, more="<actor name='walker'/>"): "<actor> walker within pillar",
    f"<state><insertions>{model(CYLINDER)}</insertions></state>": "<insertions> in <state>",
    model("<capsule><radius>1</radius></capsule>"): "a capsule of pillar",
    model("<heightmap/>"): "a heightmap of pillar",
    model("<plane><normal>1 0 0</normal></plane>"): "a plane of pillar",
    "<model name='seen'><link><visual name='v'/></link></model>": "seen, which has no <collision>",
}


@pytest.mark.parametrize("text", LEFT_OUT)
def test_every_body_is_read_or_named(text: str) -> None:
    """Also what stands beside the first world in the file; light, physics and the like are no bodies."""
    silent = "<light name='sun'/><physics/><gravity>0 0 -9.8</gravity><state><sim_time>1 0</sim_time></state>"
    named = world(silent + text + model("<empty/>", name="nothing"))
    assert LEFT_OUT[text] in named.left_out
    assert len(named.left_out) == 1
    beside = gazebo.world("<sdf><world name='w'/><world name='other'/></sdf>", "w.world")
    assert beside.left_out == ["<world> other"]


RELATIVE = "relative_to='x' f="
BOMB = '<!DOCTYPE s [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><sdf><world name="&b;"/></sdf>'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "w:1: not XML"),
        ("<sdf>\n<world>\n", "w:3: not XML"),
        ("<sdf><world name='&nbsp;'/></sdf>", "w:1: not XML: undefined entity"),
        (BOMB, "w:1: a DTD is given"),
        ("<sdf/>", "w:1: sdf: no world"),
        ("<svg/>", "w:1: svg: no world"),
        (f"<sdf><world>\n{model(CYLINDER, (0, 0, 0, math.nan))}</world></sdf>", "w:2: <pose>: '0 0 0 0 -0 nan'"),
        (
            f"<sdf><world>{model(CYLINDER, (0, 0, 0, 0)).replace('0 -0', '0.1 -0')}</world></sdf>",
            "w:1: pillar: <pose>: '0.1 -0' is not allowed; roll and pitch must be 0",
        ),
        (f"<sdf><world>{model('<box><size>1 2</size></box>')}</world></sdf>", "w:1: <size>: '1 2' is not allowed"),
        (f"<sdf><world>{model('<box><size>1 2 0</size></box>')}</world></sdf>", "wanted: numbers above 0, in m"),
        (f"<sdf><world>{model('<sphere/>')}</world></sdf>", "w:1: pillar: <sphere>: missing; wanted: <radius>"),
        (
            f"<sdf><world>{model(CYLINDER, (0, 0, 0, 0)).replace('frame=', RELATIVE)}</world></sdf>",
            "pillar: <pose>: 'x' is not allowed; wanted: a pose in the frame of the element around it",
        ),
        (
            f"<sdf><world>{model(CYLINDER)}<state><model name='pillar'><scale>1 2 1</scale></model></state>"
            "</world></sdf>",
            "round shapes keep their proportions",
        ),
    ],
)
def test_a_world_that_cannot_be_used_is_refused_with_its_line(text: str, says: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        gazebo.world(text, "w")
    assert says in str(caught.value)


def test_a_world_of_too_many_elements_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gazebo, "MOST_ELEMENTS", 100)
    with pytest.raises(ScenarioError, match="too many elements; at most 100"):
        world("<a>" * 200 + "</a>" * 200)
