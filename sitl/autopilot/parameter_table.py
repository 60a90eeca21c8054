"""The parameters that this autopilot reads: PX4's names, types and defaults, and the range that is applied.

As in PX4, any finite value can be stored; what is applied is the value within the range here, so that no parameter can
stop the simulator.
"""

from typing import NamedTuple

from sitl.dynamics.airframe import Airframe


class Parameter(NamedTuple):
    """One parameter; an int default makes it an INT32, a float default a FLOAT."""

    name: str
    default: float | int
    low: float
    high: float


_POSITION = (
    Parameter("MPC_XY_P", 0.95, 0.01, 2.0),
    Parameter("MPC_Z_P", 1.0, 0.01, 1.5),
    Parameter("MPC_XY_VEL_P_ACC", 1.8, 0.1, 5.0),
    Parameter("MPC_XY_VEL_I_ACC", 0.4, 0.0, 10.0),
    Parameter("MPC_XY_VEL_D_ACC", 0.2, 0.0, 2.0),
    Parameter("MPC_Z_VEL_P_ACC", 4.0, 0.1, 15.0),
    Parameter("MPC_Z_VEL_I_ACC", 2.0, 0.0, 3.0),
    Parameter("MPC_Z_VEL_D_ACC", 0.0, 0.0, 2.0),
    Parameter("MPC_VELD_LP", 5.0, 0.1, 10.0),
    Parameter("MPC_XY_VEL_MAX", 12.0, 0.1, 20.0),
    Parameter("MPC_Z_VEL_MAX_UP", 3.0, 0.1, 8.0),
    Parameter("MPC_Z_VEL_MAX_DN", 1.5, 0.1, 4.0),
    Parameter("MPC_THR_MIN", 0.12, 0.01, 0.5),
    Parameter("MPC_THR_MAX", 1.0, 0.5, 1.0),
    Parameter("MPC_THR_XY_MARG", 0.3, 0.0, 0.5),
    Parameter("MPC_TILTMAX_AIR", 45.0, 5.0, 75.0),
    Parameter("MPC_TILTMAX_LND", 12.0, 5.0, 75.0),
)

_GUIDANCE = (
    Parameter("MPC_ACC_HOR", 3.0, 0.1, 15.0),
    Parameter("MPC_ACC_UP_MAX", 4.0, 0.1, 15.0),
    Parameter("MPC_ACC_DOWN_MAX", 3.0, 0.1, 15.0),
    Parameter("MPC_JERK_AUTO", 4.0, 1.0, 80.0),
    Parameter("MPC_XY_CRUISE", 5.0, 0.1, 20.0),
    Parameter("MPC_Z_V_AUTO_UP", 3.0, 0.1, 8.0),
    Parameter("MPC_Z_V_AUTO_DN", 1.5, 0.1, 4.0),
    Parameter("MPC_XY_ERR_MAX", 2.0, 0.1, 10.0),
    Parameter("MPC_XY_TRAJ_P", 0.5, 0.1, 1.0),
    Parameter("MPC_YAWRAUTO_MAX", 45.0, 1.0, 360.0),
    Parameter("NAV_ACC_RAD", 2.0, 0.05, 200.0),
    Parameter("NAV_MC_ALT_RAD", 0.8, 0.05, 200.0),
)

_TAKEOFF_AND_LANDING = (
    Parameter("COM_SPOOLUP_TIME", 1.0, 0.0, 30.0),
    Parameter("MPC_TKO_SPEED", 1.5, 0.1, 5.0),
    Parameter("MPC_TKO_RAMP_T", 3.0, 0.02, 5.0),
    Parameter("MPC_LAND_SPEED", 0.7, 0.3, 4.0),
    Parameter("MPC_LAND_CRWL", 0.3, 0.3, 4.0),
    Parameter("MPC_LAND_ALT1", 10.0, 0.0, 122.0),
    Parameter("MPC_LAND_ALT2", 5.0, 0.0, 122.0),
    Parameter("MPC_LAND_ALT3", 1.0, 0.0, 122.0),
    Parameter("LNDMC_Z_VEL_MAX", 0.25, 0.05, 0.25),
    Parameter("LNDMC_XY_VEL_MAX", 1.5, 0.1, 10.0),
    Parameter("LNDMC_ROT_MAX", 20.0, 1.0, 90.0),
    Parameter("LNDMC_TRIG_TIME", 1.0, 0.1, 10.0),
    Parameter("MIS_TAKEOFF_ALT", 2.5, 0.5, 80.0),
    Parameter("MIS_DIST_1WP", 10000.0, 0.0, 1e6),
    Parameter("MIS_YAW_ERR", 12.0, 1.0, 90.0),
    Parameter("COM_DISARM_LAND", 2.0, -1.0, 1000.0),
    Parameter("COM_DISARM_PRFLT", 10.0, -1.0, 1000.0),
)

_ATTITUDE = (
    Parameter("MC_ROLL_P", 6.5, 0.1, 12.0),
    Parameter("MC_PITCH_P", 6.5, 0.1, 12.0),
    Parameter("MC_YAW_P", 2.8, 0.1, 5.0),
    Parameter("MC_YAW_WEIGHT", 0.4, 0.0, 1.0),
    Parameter("MC_ROLLRATE_MAX", 220.0, 1.0, 1800.0),
    Parameter("MC_PITCHRATE_MAX", 220.0, 1.0, 1800.0),
    Parameter("MC_YAWRATE_MAX", 200.0, 1.0, 1800.0),
    Parameter("MC_ROLLRATE_P", 0.15, 0.01, 0.5),
    Parameter("MC_ROLLRATE_I", 0.2, 0.0, 2.0),
    Parameter("MC_ROLLRATE_D", 0.003, 0.0, 0.01),
    Parameter("MC_RR_INT_LIM", 0.3, 0.0, 1.0),
    Parameter("MC_PITCHRATE_P", 0.15, 0.01, 0.6),
    Parameter("MC_PITCHRATE_I", 0.2, 0.0, 2.0),
    Parameter("MC_PITCHRATE_D", 0.003, 0.0, 0.01),
    Parameter("MC_PR_INT_LIM", 0.3, 0.0, 1.0),
    Parameter("MC_YAWRATE_P", 0.2, 0.0, 0.6),
    Parameter("MC_YAWRATE_I", 0.1, 0.0, 2.0),
    Parameter("MC_YAWRATE_D", 0.0, 0.0, 0.01),
    Parameter("MC_YR_INT_LIM", 0.3, 0.0, 1.0),
    Parameter("MC_YAW_TQ_CUTOFF", 2.0, 0.0, 10.0),
    Parameter("IMU_DGYRO_CUTOFF", 30.0, 1.0, 1000.0),
)

_SAFETY = (
    Parameter("COM_OF_LOSS_T", 1.0, 0.0, 60.0),
    Parameter("COM_OBL_RC_ACT", 0, 0, 7),
    Parameter("COM_DL_LOSS_T", 10, 5, 300),
    Parameter("COM_OBC_LOSS_T", 5.0, 0.0, 60.0),
    Parameter("COM_FAIL_ACT_T", 5.0, 0.0, 25.0),
    Parameter("NAV_DLL_ACT", 0, 0, 6),
    Parameter("COM_LOW_BAT_ACT", 3, 0, 3),
    Parameter("BAT_LOW_THR", 0.15, 0.12, 0.5),
    Parameter("BAT_CRIT_THR", 0.07, 0.05, 0.5),
    Parameter("BAT_EMERGEN_THR", 0.05, 0.03, 0.5),
    Parameter("SIM_BAT_DRAIN", 60.0, 1.0, 86400.0),
    Parameter("SIM_BAT_MIN_PCT", 50.0, 0.0, 100.0),
    Parameter("GF_ACTION", 2, 0, 5),
    Parameter("SYS_FAILURE_EN", 0, 0, 1),
    Parameter("GF_MAX_HOR_DIST", 0.0, 0.0, 1e6),
    Parameter("GF_MAX_VER_DIST", 0.0, 0.0, 1e6),
    Parameter("CBRK_FLIGHTTERM", 121212, 0, 121212),
    Parameter("COM_LKDOWN_TKO", 3.0, -1.0, 5.0),
    Parameter("EKF2_NOAID_TOUT", 5000000, 500000, 10000000),
    Parameter("FD_FAIL_P", 60, 0, 180),
    Parameter("FD_FAIL_P_TTRI", 0.3, 0.02, 5.0),
    Parameter("FD_FAIL_R", 60, 0, 180),
    Parameter("FD_FAIL_R_TTRI", 0.3, 0.02, 5.0),
    Parameter("RTL_TYPE", 0, 0, 3),
    Parameter("RTL_RETURN_ALT", 30.0, 0.0, 1000.0),
    Parameter("RTL_DESCEND_ALT", 10.0, 0.0, 1000.0),
    Parameter("RTL_LAND_DELAY", 0.0, -1.0, 3600.0),
    Parameter("RTL_MIN_DIST", 10.0, 0.5, 1000.0),
    Parameter("RTL_CONE_ANG", 45, 0, 90),
)


_FOLLOW = (
    Parameter("FLW_TGT_HT", 8.0, 1.0, 1000.0),
    Parameter("FLW_TGT_DST", 8.0, 1.0, 1000.0),
    Parameter("FLW_TGT_FA", 180.0, -180.0, 180.0),
    Parameter("FLW_TGT_RS", 0.1, 0.0, 0.99),
    Parameter("FLW_TGT_ALT_M", 0, 0, 2),
    Parameter("FLW_TGT_MAX_VEL", 5.0, 0.1, 20.0),
)

_MANUAL = (
    Parameter("COM_RC_IN_MODE", 1, 0, 4),
    Parameter("COM_RC_LOSS_T", 0.5, 0.0, 35.0),
    Parameter("COM_RC_OVERRIDE", 1, 0, 3),
    Parameter("COM_RC_STICK_OV", 30.0, 5.0, 80.0),
    Parameter("COM_RCL_EXCEPT", 0, 0, 31),
    Parameter("NAV_RCL_ACT", 2, 0, 6),
    Parameter("MPC_VEL_MANUAL", 10.0, 3.0, 20.0),
    Parameter("MPC_JERK_MAX", 8.0, 0.5, 500.0),
    Parameter("MPC_XY_MAN_EXPO", 0.6, 0.0, 1.0),
    Parameter("MPC_Z_MAN_EXPO", 0.6, 0.0, 1.0),
    Parameter("MPC_YAW_EXPO", 0.6, 0.0, 1.0),
    Parameter("MPC_HOLD_DZ", 0.1, 0.0, 0.9),
    Parameter("MPC_HOLD_MAX_XY", 0.8, 0.05, 3.0),
    Parameter("MPC_HOLD_MAX_Z", 0.6, 0.05, 3.0),
    Parameter("MPC_MAN_TILT_MAX", 35.0, 1.0, 70.0),
    Parameter("MPC_MAN_Y_MAX", 150.0, 0.1, 400.0),
    Parameter("MPC_MANTHR_MIN", 0.08, 0.0, 0.5),
    Parameter("MC_ACRO_P_MAX", 100.0, 0.0, 1800.0),
    Parameter("MC_ACRO_R_MAX", 100.0, 0.0, 1800.0),
    Parameter("MC_ACRO_Y_MAX", 100.0, 0.0, 1800.0),
    Parameter("MC_SLOW_DEF_HVEL", 3.0, 0.1, 20.0),
    Parameter("MC_SLOW_DEF_YAWR", 45.0, 1.0, 400.0),
)


def parameter_table(airframe: Airframe) -> tuple[Parameter, ...]:
    """All parameters of one vehicle, sorted by name as their indices count."""
    own = (
        Parameter("MPC_THR_HOVER", round(airframe.hover_thrust, 3), 0.1, 0.8),
        Parameter("THR_MDL_FAC", airframe.thrust_curve, airframe.thrust_curve, airframe.thrust_curve),
    )
    return tuple(sorted(_POSITION + _GUIDANCE + _TAKEOFF_AND_LANDING + _ATTITUDE + _SAFETY + _FOLLOW + _MANUAL + own))
