def joint_margin(*a, **k): raise NotImplementedError
