"""Warp kernels and functions: kinematics, features, rewards, actions, torques, resets, metrics.

Installed as ``artigrasp.kernels``. Nothing here reads files or knows about torch.
"""
