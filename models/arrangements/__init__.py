"""Fixed arrangements of objects, which evaluations share, and the public test cases of others.

`models.arrangements.library` lists and loads those of this package, `models.arrangements.cases`
reads the case files of Vision-Language-Grasping and A2, and `models.arrangements.paraphrases` has
other wordings of every goal.
"""
