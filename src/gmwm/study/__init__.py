"""The simulation study of Stebler et al. (2012), and a harder case, over the public API."""

from gmwm.study.appendix import converge, convergence_table
from gmwm.study.choice import choice_study, choice_table
from gmwm.study.demo import compare, simulated_imu
from gmwm.study.demo_files import write_demo_files
from gmwm.study.emulated_logs import FAULTS, emulated_log, sensors
from gmwm.study.figures import boxplots
from gmwm.study.navigation import reproduce_figure
from gmwm.study.runs import run_study
from gmwm.study.studies import FIGURES, STUDIES, Study
from gmwm.study.summary import summarise
from gmwm.study.turns import reproduce_rotation

__all__ = [
    "FAULTS",
    "FIGURES",
    "STUDIES",
    "Study",
    "boxplots",
    "choice_study",
    "choice_table",
    "compare",
    "converge",
    "convergence_table",
    "emulated_log",
    "reproduce_figure",
    "reproduce_rotation",
    "run_study",
    "sensors",
    "simulated_imu",
    "summarise",
    "write_demo_files",
]
