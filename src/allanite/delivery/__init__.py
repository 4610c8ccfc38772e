# SPDX-License-Identifier: BSD-3-Clause
"""What the commands hand over: the files of a study, the facts of a recording, curves and models.

Each function is one line of a command, and can be called as well without the command line.
"""

from allanite.delivery.alignment import alignment_of, alignment_of_means
from allanite.delivery.bounds import bounds_of, bounds_of_study, with_bounds
from allanite.delivery.calibration import calibration_of, calibration_of_means
from allanite.delivery.capture import captured_document, record_to
from allanite.delivery.comparison import comparison_of
from allanite.delivery.curves import (
    Fitted,
    fit_file,
    interval_errors_of,
    joined,
    over_floor_of,
    plain_curves,
    save_curve,
    simulate_to,
)
from allanite.delivery.datasheet import datasheet_of
from allanite.delivery.dead_reckoning import dead_reckoning_of
from allanite.delivery.difference import difference_of
from allanite.delivery.earth import earth_rate_of, north_of, null_of, plan_of
from allanite.delivery.environment import environment_of, save_residual
from allanite.delivery.exporting import export_of
from allanite.delivery.filtering import aided_of, filter_of, refuse_corrected, save_corrected
from allanite.delivery.measurement import Measured, refuse_measurement, write_measurement
from allanite.delivery.monitor import RunWatch
from allanite.delivery.pictures import Delivered, refuse_figure, save_figure
from allanite.delivery.position_plan import position_plan_of
from allanite.delivery.rate_table import rate_table_of
from allanite.delivery.recordings import describe, file_sha256, has_gaps, is_lossy, read_floor, read_part
from allanite.delivery.recovery import compaction_of, recovery_document, recovery_of
from allanite.delivery.redundancy import combination_of, directions_from, save_combined
from allanite.delivery.selection import selection_of
from allanite.delivery.separation import separation_of
from allanite.delivery.spectrum import spectra_of
from allanite.delivery.study import RESULTS, curve_of, refuse_results, study_of, write_results
from allanite.delivery.unit_file import write_unit
from allanite.delivery.variation import variation_of

__all__ = [
    "RESULTS",
    "Delivered",
    "Fitted",
    "Measured",
    "RunWatch",
    "aided_of",
    "alignment_of",
    "alignment_of_means",
    "bounds_of",
    "bounds_of_study",
    "calibration_of",
    "calibration_of_means",
    "captured_document",
    "combination_of",
    "compaction_of",
    "comparison_of",
    "curve_of",
    "datasheet_of",
    "dead_reckoning_of",
    "describe",
    "difference_of",
    "directions_from",
    "earth_rate_of",
    "environment_of",
    "export_of",
    "file_sha256",
    "filter_of",
    "fit_file",
    "has_gaps",
    "interval_errors_of",
    "is_lossy",
    "joined",
    "north_of",
    "null_of",
    "over_floor_of",
    "plain_curves",
    "plan_of",
    "position_plan_of",
    "rate_table_of",
    "read_floor",
    "read_part",
    "record_to",
    "recovery_document",
    "recovery_of",
    "refuse_corrected",
    "refuse_figure",
    "refuse_measurement",
    "refuse_results",
    "save_combined",
    "save_corrected",
    "save_curve",
    "save_figure",
    "save_residual",
    "selection_of",
    "separation_of",
    "simulate_to",
    "spectra_of",
    "study_of",
    "variation_of",
    "with_bounds",
    "write_measurement",
    "write_results",
    "write_unit",
]
