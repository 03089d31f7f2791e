"""The experiment on the 7×7 grid: what human and robot may do, when, and which takeover each move belongs to.

Read in this order: :mod:`grid`, :mod:`paths`, :mod:`owners`, :mod:`partners`, :mod:`episode`, :mod:`timing`,
:mod:`session`, whose parameters are in :mod:`params`; :mod:`conditions` labels moves of logs and simulations alike;
:mod:`rules` checks both, by :mod:`measures` and :mod:`path_measures` of what :mod:`retrace` finds between a table's
lines.
"""
