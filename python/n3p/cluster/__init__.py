"""Collections, volume runs and trainings on many machines: on Ray, or as array jobs of Slurm.

``python -m n3p.cluster --help`` tells all; docs/cluster.md is the guide.

The work itself is done by the programs ``n3p-collect``, ``n3p-experiment volume`` and
``n3p-train``, which every machine needs; their shards, checksums and merges are what counts as
finished here. `work` and `seeds` say what there is to do, `engine` has Ray do it, `slurm` writes a
script that has Slurm do it, and `worker` is what runs on a machine. Only `engine` needs Ray
(``pip install 'n3p[cluster]'``).
"""
