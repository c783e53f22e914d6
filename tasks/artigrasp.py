"""The paper's method, its ablations and its baseline that is learned.

First each hand learns alone on objects whose base is fixed, then both together on free ones (Section 4.4). Where the
paper speaks, it is followed: reward weights, network, discount, clipping, rate and batch sizes are those of the
supplement's table, which are the defaults of the config classes. Where the authors' release says something else:

- it takes 4 passes of 4 batches in order, the paper 20 updates per iteration: 5 passes of 4 shuffled batches here;
- its keypoint weights come out as 1.0 and 16.3 after a normalisation, and in the right hand's first phase the latter
  fall on others than fingertips: the paper's 3 and 12 here;
- it scales contact and force rewards by 4/3 for the left hand's first phase, and velocity penalties by part: the
  paper's one table for all here;
- it counts impulses of the last 2.5 ms, the paper forces: forces in newtons, averaged over the control step, here;
- it penalises the object's speed relative to the wrist and clips rewards to 10: neither here, for the paper does not;
- it simulates 1400, 1000 and 2000 worlds in its three trainings, the paper 2000: 2000 here.

Where the paper is silent, the release is followed: half of each object's worlds play grasps and half articulations, but
the left hand alone learns grasps only; hands start 0.1 m from their reference and 0.3 m if they take no part, with
fingers opened to 0.3 of it and noise (the release draws it in the second phase too, then forgets to apply it); the rate
follows the KL divergence; exploration starts with a deviation of 1 (the release's stays there, by mistake as it
seems; here it is learned); and the iterations of each training are those of its published snapshots.
"""

from dataclasses import replace

from artigrasp.config import CurriculumConfig, RewardConfig, TaskConfig
from artigrasp.tasks.objects import PAPER_OBJECTS

RIGHT = TaskConfig(
    name="right-fixed",
    description="The paper's first phase, right hand: fixed base, a 51-joint residual every control step",
    kinds=("articulate", "grasp"),
    iterations=8600,
)

LEFT = replace(
    RIGHT,
    name="left-fixed",
    description="The paper's first phase, left hand: grasps only, as released",
    hands=("left",),
    kinds=("grasp",),
    iterations=2000,
)

BOTH = replace(
    RIGHT,
    name="both-free",
    description="The paper's second phase and its evaluation: both hands, free base, two policies",
    hands=("left", "right"),
    fixed_base=False,
    iterations=400,
)

D_GRASP = replace(
    BOTH,
    name="d-grasp",
    description="The baseline D-Grasp: both hands learn grasps of free objects directly, and know of no hinge",
    kinds=("grasp",),
    include_hinge_features=False,
    reward=RewardConfig(angle=0.0, displacement=0.0),
    iterations=10_000,
)

ARTIGRASP = CurriculumConfig(
    name="artigrasp",
    description="The paper's method: each hand alone on fixed objects, then both on free ones",
    stages=(RIGHT, LEFT, BOTH),
)

WITHOUT_CURRICULUM = replace(
    ARTIGRASP,
    name="artigrasp-without-curriculum",
    description="Ablation: both hands on free objects from the start",
    stages=(replace(BOTH, iterations=10_000),),
)

WITHOUT_COOPERATION = replace(
    ARTIGRASP,
    name="artigrasp-without-cooperation",
    description="Ablation: hands that learned alone, put together without learning more",
    stages=(RIGHT, LEFT, replace(BOTH, iterations=0)),
)

WITHOUT_HINGE_FEATURES = replace(
    ARTIGRASP,
    name="artigrasp-without-hinge-features",
    description="Ablation: policies that do not see the hinge (the paper's articulation features)",
    stages=tuple(replace(stage, include_hinge_features=False) for stage in ARTIGRASP.stages),
)

LEFT_OUT = tuple(
    replace(
        ARTIGRASP,
        name=f"artigrasp-without-{name}",
        description=f"The paper's method on the other seven of its objects, to be measured on {name}",
        objects=tuple(each for each in PAPER_OBJECTS if each != name),
    )
    for name in PAPER_OBJECTS
)

TASKS = (RIGHT, LEFT, BOTH, D_GRASP)
CURRICULA = (ARTIGRASP, WITHOUT_CURRICULUM, WITHOUT_COOPERATION, WITHOUT_HINGE_FEATURES, *LEFT_OUT)
