"""The task panels, one file each; `show` opens one."""
