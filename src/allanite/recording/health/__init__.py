# SPDX-License-Identifier: BSD-3-Clause
"""What is wrong with a recording: findings with a severity, a place and a count; never a silent repair.

`examination` holds `check`, which looks, and `prepare`, which acts: it refuses what is fatal and was not accepted, and
leaves out the samples that a finding excludes. Left-out samples become gaps; each exclusion is a finding and a step of
the history.

A channel is read once, block by block (`survey`); the detectors are small functions of what that pass counted:

=============== ==========================================================================
`values`        missing samples, overload words, saturation, clipping, nonsense
`resolution`    the step of the values against the noise
`padding`       zeros, words for "no value", rows without a reading
`repeats`       frozen readings, interleaved sensors, twin channels
`held`          samples that repeat because the sensor is slower than the log
`tails`         contaminated noise
`disturbance`   impulses; stretches that move more, or less, than the rest
`constancy`     noise that is larger in some parts of the record
`raw_counts`    whole numbers without a unit, and the scale factor that may fit
`motion`        a unit that was turned, by the direction of gravity
`meaning`       units, gravity, removed bias, aperture
`log`           time stamps and text, from the readers' notes
`run`           what a recorder noted: why samples are missing, which are in doubt, the meter's zero, the scale factor
=============== ==========================================================================

`CATALOGUE` says of each code what it means and what accepting it risks. Lines in the spectrum and the sensor's
low-pass filter are found by `allanite.noise.spectrum`. This file imports nothing: a finding is read without detectors.
"""
