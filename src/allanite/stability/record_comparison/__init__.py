# SPDX-License-Identifier: BSD-3-Clause
"""Several records of one sensor or of several: are they the same within their intervals, and how much do they scatter?

Two questions, two answers. *Equality*: did the records come from one noise, as far as they can tell? *Population*: if
they come from a kind of sensor, what is its middle, its spread, and where will the next one lie? Every record takes
part in both with all that it knows of a parameter: its profile, also where that is only an upper limit.

``estimation``  compare(records): what a user calls.
``series``      one channel of one record, out of a study or a curve; which channels belong together.
``pooled``      one noise model for several records of different length, rate and sampling.
``profiles``    what one record says of one parameter: how much worse the fit gets away from its best value.
``equality``    the tests of parameters; ``null_law`` their distribution where parameters may not be negative.
``curves``      the test of the Allan curves, lag by lag and all together, without a model of their shape.
``population``  mean, spread and next sensor: random effects.
``bias``        the mean of each record, with its uncertainty by the noise model.
``results``     Comparison and what it is made of; ``verdict`` what it may come to, ``words`` says it in a sentence.
``remarks``     what a reader must know besides.
"""
