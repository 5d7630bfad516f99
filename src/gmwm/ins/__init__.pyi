from .covariance import (
    AIDINGS as AIDINGS,
    Analysis as Analysis,
    covariance_analysis as covariance_analysis,
    loiter_with_outages as loiter_with_outages,
)
from .filter.aiding import (
    Aiding as Aiding,
    Fixes as Fixes,
    Outage as Outage,
    barometer as barometer,
    gnss as gnss,
    odometry as odometry,
    poses as poses,
    standstills as standstills,
    wheels as wheels,
)
from .filter.filter import (
    FilterInnovations as FilterInnovations,
    InitialSd as InitialSd,
    Solution as Solution,
    navigate as navigate,
)
from .increments import (
    Imu as Imu,
    Preintegration as Preintegration,
    emulate as emulate,
    preintegrate as preintegrate,
)
from .logs.comparison import (
    Comparison as Comparison,
    Outcome as Outcome,
    Paired as Paired,
    compare as compare,
)
from .logs.fix_log import read_fixes as read_fixes
from .logs.imu_log import read_imu as read_imu
from .logs.measured import Measured as Measured
from .logs.navigated import Navigated as Navigated
from .sensors import (
    Recorded as Recorded,
    SensorErrors as SensorErrors,
    SensorModels as SensorModels,
)
from .simulation.consistency import (
    Consistency as Consistency,
    FilterErrors as FilterErrors,
    at_epoch as at_epoch,
    difference as difference,
    innovation_test as innovation_test,
    over_time as over_time,
    spread as spread,
)
from .simulation.trials import (
    Experiment as Experiment,
    MonteCarlo as MonteCarlo,
    Scenario as Scenario,
    Simulated as Simulated,
    monte_carlo as monte_carlo,
)
from .simulation.validation import Validation as Validation
from .spec import experiment_from as experiment_from
from .trajectory.manoeuvres import (
    Accelerate as Accelerate,
    Climb as Climb,
    Stop as Stop,
    Straight as Straight,
    Turn as Turn,
    perform as perform,
    through as through,
)
from .trajectory.missions import (
    car_drive as car_drive,
    fixed_wing_loiter as fixed_wing_loiter,
    helicopter_mapping as helicopter_mapping,
)
from .trajectory.trajectory import NavState as NavState, Trajectory as Trajectory
