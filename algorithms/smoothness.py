"""What neighbouring pixels pay for different planes, less where the view has an edge: a group of parameters."""

from collections.abc import Mapping

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.cuts.expansion import Weights, contrast_weights


@frozen
class Smoothness:
    """The price w of a change of plane between neighbouring pixels. A group of parameters.

    Parameters
    ----------
    smoothness
        w across an edge, in units of the cost; 0 = the method's own choice for its costs.
    flat
        How many times as much w is where the view is flat.
    edge
        Grey levels. The view is flat between two pixels if no colour differs by this much.
    """

    smoothness: float = field(default=0.0, validator=validators.ge(0))
    flat: float = field(default=2.0, validator=validators.ge(0))
    edge: float = field(default=8.0, validator=validators.ge(0))

    @property
    def silent(self) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those that are not read beside the others."""
        return {
            **({"edge": "flat other than 1"} if self.flat == 1 else {}),
            **({"flat": "edge above 0"} if self.edge == 0 else {}),
        }

    def weights(self, image: NDArray[np.uint8], own: float) -> Weights:
        """The weights w between the pixels of a view.

        Parameters
        ----------
        image
            (H, W, 3) uint8.
        own
            The method's own choice of `smoothness`.

        Returns
        -------
        (H - 1, W) to the pixel below and (H, W - 1) to the pixel on the right, both float32.
        """
        return contrast_weights(image, self.smoothness or own, self.flat, self.edge)
