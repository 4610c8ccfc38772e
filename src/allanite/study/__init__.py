# SPDX-License-Identifier: BSD-3-Clause
"""Everything that one recording says, as one document.

``study``        `characterize` makes a Study; it is all that crosses from the science to the presentation
``request``      what is asked of it
``channel``      what it says of one channel; ``sample_pass`` reads its samples once, ``overview`` their envelope
``schema``       the shape of the document, checked when one is read
``model_file``   models out of studies, fits, sheets and words, and into files
``datasheet``    what a data sheet promises, beside what was measured
"""
