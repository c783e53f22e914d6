"""What happens to the panel's widgets."""

from collections.abc import Callable

from viser import GuiEvent


def from_people(act: Callable[[GuiEvent], None]) -> Callable[[GuiEvent], None]:
    """A widget's callback that leaves out the updates that the program itself makes."""

    def handle(event: GuiEvent) -> None:
        if event.client is not None:
            act(event)

    return handle
