"""Steps sheeprl's own agent of DreamerV3 with drawn weights. Run by the Python of `.venv-dreamer`.

Arguments: a folder. It has `sizes.json` and `observations.npy`, shape (steps, worlds, terms); beside them come
`weights.pt`, state dictionaries as the trainer sees them, and `shares.npy`, shape (steps, worlds, actuators): means of
the actor's distribution, where the discrete state is the likeliest one at each step.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import hydra
import numpy as np
import torch
from gymnasium import spaces
from lightning import Fabric
from omegaconf import OmegaConf
from sheeprl.algos.dreamer_v2.utils import compute_stochastic_state
from sheeprl.algos.dreamer_v3.agent import build_agent
from sheeprl.utils.utils import dotdict

folder = Path(sys.argv[1])
sizes = json.loads((folder / "sizes.json").read_text())
seen = torch.from_numpy(np.load(folder / "observations.npy"))
overrides = {
    "exp": "dreamer_v3", "algo": "dreamer_v3_XS", "env": "gym", "root_dir": "r", "run_name": "r",
    "env.num_envs": seen.shape[1], "algo.cnn_keys.encoder": "[]", "algo.cnn_keys.decoder": "[]",
    "algo.mlp_keys.encoder": "[vector]", "algo.mlp_keys.decoder": "[vector]",
    "algo.dense_units": sizes["dense"], "algo.mlp_layers": sizes["layers"],
    "algo.world_model.recurrent_model.recurrent_state_size": sizes["recurrent"],
    "algo.world_model.transition_model.hidden_size": sizes["dense"],
    "algo.world_model.representation_model.hidden_size": sizes["dense"],
    "algo.world_model.stochastic_size": sizes["groups"], "algo.world_model.discrete_size": sizes["classes"],
}  # fmt: skip
with hydra.initialize_config_module("sheeprl.configs", version_base="1.3"):
    composed = hydra.compose("config", overrides=[f"{key}={value}" for key, value in overrides.items()])
cfg = dotdict(OmegaConf.to_container(composed, resolve=True, throw_on_missing=True))
torch.manual_seed(1)
torch.set_num_threads(1)
space = spaces.Dict({"vector": spaces.Box(-np.inf, np.inf, (seen.shape[2],), np.float32)})
fabric = Fabric(accelerator="cpu", devices=1)
world_model, actor, _, _, player = build_agent(fabric, (sizes["actuators"],), True, cfg, space)
with torch.no_grad():
    for part in (world_model, actor):
        for weights in part.parameters():
            weights.copy_(0.5 * torch.randn_like(weights))
    torch.save({"world_model": world_model.state_dict(), "actor": actor.state_dict()}, folder / "weights.pt")
    player.init_states()
    shares = []
    for row in seen[:, None]:
        embedded = player.encoder({"vector": row})
        before = torch.cat((player.stochastic_state, player.actions), -1)
        player.recurrent_state = player.rssm.recurrent_model(before, player.recurrent_state)
        logits, _ = player.rssm._representation(player.recurrent_state, embedded)
        likeliest = compute_stochastic_state(logits, discrete=sizes["classes"], sample=False)
        player.stochastic_state = likeliest.reshape(1, seen.shape[1], -1)
        _, (chosen,) = player.actor(torch.cat((player.stochastic_state, player.recurrent_state), -1))
        player.actions = chosen.mean
        shares.append(chosen.mean[0].numpy())
np.save(folder / "shares.npy", np.array(shares))
