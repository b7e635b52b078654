"""What MuJoCo finds wrong with a model, said in one line."""

import mujoco
import pytest

from jaxbiped.physics.mjcf_errors import mjcf_problem

BODY = "<mujoco>\n<worldbody>\n{}\n</worldbody>\n</mujoco>"


@pytest.mark.parametrize(
    "xml, said",
    [
        ("<mujoco>\n<foo/>\n</mujoco>", "line 2, foo: unrecognized element"),
        ("<mujoco><worldbody", "line 1: is not well-formed XML"),
        ("", "empty file 'model_.xml'"),
        (BODY.format("<body name='a'><joint/></body>"), "line 3, a: mass and inertia of moving bodies"),
        (BODY.format("<geom size='-1'/>"), "line 3: size 0 must be positive in geom"),
        (BODY.format("<geom type='mesh' mesh='q'/>"), "line 3: mesh 'q' not found in geom 0"),
    ],
)
def test_line_element_and_diagnosis(xml, said):
    with pytest.raises(ValueError) as caught:
        mujoco.MjSpec.from_string(xml).compile()
    problem = mjcf_problem(caught.value)
    assert problem.startswith(said) and "\n" not in problem and "Error" not in problem


def test_any_other_text_is_kept_in_one_line():
    assert mjcf_problem(ValueError("one\n two\n")) == "one two"
