"""The phases of long motions, as data (paper, Section Sequence Generation).

Each is a phase of PD+IK; a policy that has learned a phase's skill takes it over.
"""

from dataclasses import replace

from artigrasp.config import ActionConfig, PDGain, PDGains, PhaseConfig

_REACH = ActionConfig(wrist_prior="hinge", finger_prior="reference", residual=None, approach_steps=60, close_start=30)

SOFT_FINGERS = PDGains(PDGain(kp=400.0, kd=20.0), PDGain(kp=50.0, kd=0.2), PDGain(kp=10.0, kd=0.2))
"""Fingers that give way while they close push the object about less."""
STRONG_WRISTS = PDGains(PDGain(kp=1000.0, kd=45.0), PDGain(kp=50.0, kd=0.2), PDGain(kp=50.0, kd=0.2))
"""Wrists that carry; the authors' stiffness."""
YIELDING_FINGERS = PDGain(kp=2.0, kd=0.2)
"""Fingers that let go: stiffer ones topple what they open against."""
LOOSE_HANDS = PDGains(PDGain(kp=50.0, kd=10.0), SOFT_FINGERS.wrist_rotation, YIELDING_FINGERS)
"""Wrists that give way too, so that it is the hand that moves when opening fingers push."""

GRASP = PhaseConfig(
    name="grasp",
    skill="grasp",
    aim="grasp",
    least_steps=150,
    most_steps=220,
    opens=False,
    action=replace(_REACH, approach_arc=0.05, close_start=60, close_end=110, follow=0.0, press=0.02),
    gains=replace(SOFT_FINGERS, wrist_translation=STRONG_WRISTS.wrist_translation),
)
"""Both hands go to where the object stands and then close on it, until it rests in them.

Their wrists are as stiff as those that carry, so that nothing jerks when the object is lifted.
"""

RELOCATE = PhaseConfig(
    name="relocate",
    skill="grasp",
    aim="object",
    most_steps=300,
    carries=True,
    opens=False,
    retry_from="grasp",
    action=ActionConfig(
        wrist_prior="transport",
        finger_prior="closed",
        residual=None,
        squeeze=0.15,
        press=0.02,
        carry_speed=0.15,
        carry_turn_speed=0.4,
        carry_feedback=1.0,
    ),
    gains=STRONG_WRISTS,
)
"""The hands take the object to its target: the paper's motion synthesis module, on a planned path."""

HOLD = replace(RELOCATE, name="hold", aim="time", most_steps=50)
"""They keep it there."""

LIFT = 0.15
"""Height over its target at which an object is carried that will be put down [m] (the authors' script)."""

PUT_DOWN = replace(
    RELOCATE, name="put down", most_steps=200, action=replace(RELOCATE.action, carry_speed=0.1, carry_turn_speed=0.2)
)
"""They lower it to its target."""

RELEASE = PhaseConfig(
    name="release",
    most_steps=40,
    opens=False,
    action=ActionConfig(
        wrist_prior="retreat", finger_prior="opening", residual=None, retreat_distance=0.0, close_start=0, close_end=30
    ),
    gains=LOOSE_HANDS,
)
"""The fingers open."""

RETREAT = PhaseConfig(
    name="retreat",
    aim="hands",
    least_steps=80,
    most_steps=120,
    opens=False,
    action=ActionConfig(
        wrist_prior="retreat", finger_prior="opening", residual=None, approach_steps=80, close_start=0, close_end=0
    ),
    gains=replace(SOFT_FINGERS, fingers=YIELDING_FINGERS),
)
"""The hands draw out of their grip."""

TRANSIT = PhaseConfig(
    name="transit",
    reference="second",
    aim="hands",
    steadies=True,
    least_steps=120,
    most_steps=180,
    opens=False,
    action=ActionConfig(
        wrist_prior="transit", finger_prior="opening", residual=None, approach_steps=120, close_start=0, close_end=0
    ),
    gains=SOFT_FINGERS,
)
"""The hands go around the object to where the next reference is approached from, or wait out of the way."""

WITHDRAW = replace(
    TRANSIT, name="withdraw", reference="first", steadies=False, action=replace(TRANSIT.action, wrist_prior="home")
)
"""The hands go to where they waited at first, so as not to be in the way of what comes next."""

ARTICULATE = PhaseConfig(
    name="articulate",
    skill="articulate",
    reference="second",
    aim="hinge",
    most_steps=300,
    steadies=True,
    action=replace(
        _REACH, wrist_prior="schedule", close_start=60, close_end=100, follow=0.0, lead_start=110, lead_end=250
    ),
)
"""One hand opens the object to its target angle, slowly; the other holds the base if it does so in the reference."""

GRASPING = (GRASP, RELOCATE, HOLD)
"""Grasp the object and take it to a target in the air."""

GRASP_THEN_ARTICULATE = (
    GRASP,
    replace(RELOCATE, lift=LIFT),
    PUT_DOWN,
    RELEASE,
    replace(RETREAT, places=True, retry_from="grasp"),
    TRANSIT,
    ARTICULATE,
)
"""The paper's composed task: carry the object to its target pose and open it there.

Hands grasp again what is not where it should be once they have let go of it. They do not try again to open what is
nearly open: on their way back they would take the lid along.
"""

ARTICULATE_THEN_GRASP = (
    replace(ARTICULATE, reference="first"),
    *(replace(phase, steadies=True, opens=True) for phase in (RELEASE, RETREAT)),
    replace(TRANSIT, steadies=False, opens=True),
    *(
        replace(phase, reference="second", opens=True)
        for phase in (GRASP, replace(RELOCATE, lift=LIFT), PUT_DOWN, HOLD)
    ),
)
"""The other order: open the object, then carry it."""

SEQUENCES = {"grasp-then-articulate": GRASP_THEN_ARTICULATE, "articulate-then-grasp": ARTICULATE_THEN_GRASP}
"""Sequences that make a whole motion, by name."""
