"""Pictures of a page, read back."""

from base64 import b64decode

import cv2
import numpy as np
from numpy.typing import NDArray


def read(uri: str) -> NDArray[np.uint8]:
    found = cv2.imdecode(np.frombuffer(b64decode(uri.partition(",")[2]), np.uint8), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return found.astype(np.uint8)
