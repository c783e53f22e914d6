"""Gradient descent on the joint coordinates of many hands at once."""

from collections.abc import Callable

import torch

from artigrasp.kernels.layout import DOF_COUNT

STEP = torch.tensor([*[0.001] * 3, *[0.01] * (DOF_COUNT - 3)])
"""Size of the optimiser's first steps in each joint coordinate [m, rad]; they shrink to nothing."""


def descend(
    joint_q: torch.Tensor,
    evaluate: Callable[[], tuple[torch.Tensor, torch.Tensor]],
    iterations: int,
    *,
    active: torch.Tensor | None = None,
    disturbance: torch.Tensor | None = None,
    on_iteration: Callable[[int], None] = lambda iteration: None,
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Make an energy small by Adam, whose steps follow half a cosine to zero.

    Args:
        joint_q: Joint coordinates [R, H, 51] that ``evaluate`` reads; it starts from there and overwrites them.
        evaluate: The energy of every configuration [R] and its gradient by the joint coordinates [R, H, 51].
        iterations: Steps.
        active: Which hands may move, shape [R, H]; all by default.
        disturbance: What is added before the first step, in steps, shape [R, H, 51]; nothing by default.
        on_iteration: Called with the iterations done, for progress.

    Returns:
        The joint coordinates of the least energy of each configuration [R, H, 51], that energy [R], and the energy at
        the start [R].
    """
    start, step = joint_q.clone(), STEP.to(joint_q.device)
    if active is not None:
        step = step * active[..., None]
    change = (torch.zeros_like(start) if disturbance is None else disturbance.clone()).requires_grad_()
    optimizer = torch.optim.Adam([change], lr=1.0)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, iterations)
    best, least = start.clone(), torch.full((len(start),), torch.inf, device=start.device)
    for iteration in range(iterations + 1):
        joint_q.copy_(start + step * change.detach())
        value, gradient = evaluate()
        if iteration == 0:
            first = value
        better = value < least
        best[better], least[better] = joint_q[better], value[better]
        if iteration < iterations:
            change.grad = gradient * step
            optimizer.step()
            schedule.step()
            on_iteration(iteration + 1)
    return best, least, first
