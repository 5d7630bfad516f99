"""The simulation study of Stebler et al. (2012), and a harder case, over the public API."""

from gmwm.study.demo import simulated_imu as simulated_imu, write_demo_files as write_demo_files
from gmwm.study.navigation import reproduce_figure as reproduce_figure
from gmwm.study.rotation import reproduce_rotation as reproduce_rotation
from gmwm.study.sensor import reproduce_sensor as reproduce_sensor
from gmwm.study.studies import (
    FIGURES as FIGURES,
    STUDIES as STUDIES,
    choice_study as choice_study,
    choice_table as choice_table,
    run_study as run_study,
)
from gmwm.study.summary import (
    boxplots as boxplots,
    converge as converge,
    convergence_boxes as convergence_boxes,
    convergence_table as convergence_table,
    raw_estimates as raw_estimates,
    saved as saved,
    summarise as summarise,
)
