"""The case study of Zhang et al. 2013, end to end: from the CAD model of a drawn part to a prediction.

Run ``python -m case_study`` in the folder ``examples`` (or ``make case-study``); figures and page go to
``docs``. The training set was made with CalculiX (``python -m case_study.training``); its results ship.
"""
