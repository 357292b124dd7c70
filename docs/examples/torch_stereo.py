"""A network in torch as a method: loaded once by each process that solves, on a graphics card if there is one.

matbench compare --plugin torch_stereo.py -a torch_stereo sgbm -s 'synthetic/*' --isolation shared
"""

from functools import cache
from typing import Any

import numpy as np

from matbench import Context, Estimate, Scene


@cache
def load(window: int) -> tuple[Any, str]:
    """The network and its device. torch takes seconds to import: here only a process that solves pays for it."""
    import torch

    class Network(torch.nn.Module):
        """Yours goes here. This one compares blocks, and takes the mean of the best few planes."""

        def forward(self, left: torch.Tensor, right: torch.Tensor, planes: int) -> torch.Tensor:
            costs = []
            for d in range(planes):
                shifted = torch.nn.functional.pad(right, (d, 0, 0, 0), mode="replicate")[..., : right.shape[3]]
                apart = (left - shifted).abs().mean(1, keepdim=True)
                costs.append(torch.nn.functional.avg_pool2d(apart, window, 1, window // 2, count_include_pad=False))
            share = torch.softmax(-torch.cat(costs, 1), 1)
            return (share * torch.arange(planes, device=left.device)[:, None, None]).sum(1)[0]

    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Network().eval().to(device), device


class TorchStereo:
    """A network for two views, those of the field's pair: the other one is to the right, or else to the left."""

    def __init__(self, window: int = 7) -> None:
        self.window = window

    def solve(self, scene: Scene, context: Context) -> Estimate:
        import torch

        torch.manual_seed(context.seed)
        torch.set_num_threads(context.threads)
        network, device = load(self.window)
        right, gap = scene.n - 1 - scene.ref, max(1, round(scene.pair_steps))
        flip = 1 if right >= gap or right > scene.ref else -1  # -1: to the left, so both are mirrored
        steps = min(gap, right if flip > 0 else scene.ref)
        other = scene.ref + flip * steps
        planes = max(1, int(np.ceil(scene.disparities.largest * steps)) + 1)
        images = [scene.views[view][:, ::flip].transpose(2, 0, 1) for view in (scene.ref, other)]
        told: dict[str, float] = {}
        with torch.inference_mode():
            left, right = (torch.tensor(np.float32(image[None]), device=device) for image in images)
            if device == "cuda":
                torch.cuda.reset_peak_memory_stats()
                begin, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
                begin.record()
            found = network(left, right, planes)
            if device == "cuda":
                end.record()
                torch.cuda.synchronize()  # seconds are counted until solve returns: nothing may still be under way
                told["device_seconds"] = begin.elapsed_time(end) / 1000
                told["device_mb"] = torch.cuda.max_memory_allocated() / 2**20
        disparity = found.cpu().numpy()[:, ::flip] / np.float32(steps)  # pixels per view step
        return Estimate({scene.ref: np.ascontiguousarray(disparity)}, **told)
