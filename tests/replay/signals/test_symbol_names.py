"""Names as programmers of PLCs and loggers write them, in English, German and French."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.log.raw_log import Channel
from replay.machine.config import Machine, haulotte
from replay.readers.tables.columns import unit_of
from replay.signals.name_parts import is_steering
from replay.signals.name_words import english, folded, role, tokens
from replay.signals.named_units import bare_name, unit_by_end
from replay.signals.rules import candidates
from replay.signals.symbol_rules import valve_current

STAMPS = np.arange(3, dtype=np.int64)


def column(name: str, unit: str | None = None) -> Channel:
    return Channel(name, "", name, STAMPS, np.zeros(3), unit or unit_of(name), "table")


def symbol(name: str, unit: str | None = None) -> Channel:
    return Channel(name, "", name.rpartition(".")[2], STAMPS, np.zeros(3), unit, "LREAL")


def found(channel: Channel) -> list[tuple[str, str]]:
    return [(c.signal, c.origin.unit) for c in candidates({channel.name: channel}, haulotte())]


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("n_ist_VR [1/min]", "wheel.FR.v"),
        ("n_soll_VR [1/min]", "wheel.FR.v_ref"),
        ("Drehzahl_HL_soll (U/min)", "wheel.RL.v_ref"),
        ("Istdrehzahl Rad hinten links [U/min]", "wheel.RL.v"),
        ("Solldrehzahl Vorderachse links [1/min]", "wheel.FL.v_ref"),
        ("v_HA_re_ist [km/h]", "wheel.RR.v"),
        ("VL [1/min]", None),
        ("Rad VL [1/min]", "wheel.FL.v"),
        ("n VL [1/min]", "wheel.FL.v"),
        ("Vitesse roue AV G (tr/min)", "wheel.FL.v"),
        ("Courant vanne AVG (mA)", None),
        ("fVentil_Soll_VL [mA]", None),
        ("Ventil_VL [V]", None),
        ("cmd_vel_yaw", "cmd.omega"),
        ("speed_cmd_mm_s", "cmd.v"),
        ("y_Ventil_soll_VR [%]", "wheel.FR.u"),
        ("y_Ventil_ist_VR [%]", "wheel.FR.u_applied"),
        ("Stellgröße_HR (%)", "wheel.RR.u"),
        ("Stellwert_HR (%)", "wheel.RR.u"),
        ("Ventil VL Stellwert [%]", "wheel.FL.u"),
        ("Ventil_VL_Stellgröße [%]", "wheel.FL.u"),
        ("Stellsignal Ventil HL [%]", "wheel.RL.u"),
        ("Ventil VR Stellstrom [mA]", None),
        ("Ventil VR Istwert [%]", "wheel.FR.u_applied"),
        ("Schieberstellung VL [%]", "wheel.FL.u_applied"),
        ("Ventilstrom_VR [mA]", None),
        ("Drehmoment_VL [Nm]", "wheel.FL.effort"),
        ("Lenkwinkel_soll_VA [°]", "steer.front.phi_ref"),
        ("Lenkwinkel_ist_HA [°]", "steer.rear.phi"),
        ("Lenkventil_HA [%]", "steer.rear.u"),
        ("v_soll [km/h]", "cmd.v"),
        ("Fahrgeschwindigkeit_Soll (km/h)", "cmd.v"),
        ("vFzgSoll [km/h]", "cmd.v"),
        ("Fahrhebel [km/h]", "cmd.v"),
        ("Fahrhebel [%]", None),
        ("GVL_HMI.fJoystickFahren [km/h]", "cmd.v"),
        ("Joystick_v [m/s]", "cmd.v"),
        ("Sollwert [m/s]", "cmd.v"),
        ("Sollwert [bar]", None),
        ("cmd_yaw", "cmd.omega"),
        ("heater_cmd_w", None),
        ("antenna_ref_yaw", None),
        ("valve_percent_FL", "wheel.FL.u"),
        ("Joystick_w [rad/s]", "cmd.omega"),
        ("Ventil Y VR [%]", "wheel.FR.u"),
        ("Ventil Y Ist VR [%]", "wheel.FR.u_applied"),
        ("vFzgSoll", None),
        ("phiSoll_VA [°]", "steer.front.phi_ref"),
        ("Raddrehzahl vorne rechts Istwert [U/min]", "wheel.FR.v"),
        ("Druck A vorne rechts [bar]", "wheel.FR.pressure_a"),
        ("Gierrate_soll [°/s]", "cmd.omega"),
        ("Geschwindigkeit über Grund [km/h]", "gnss.speed"),
        ("GVL_Navi.fGeschwindigkeitUeberGrund [km/h]", "gnss.speed"),
        ("speed_over_ground [m/s]", "gnss.speed"),
        ("vitesse sur le fond (km/h)", "gnss.speed"),
        ("max. Geschwindigkeit über Grund [km/h]", None),
        ("Sollgeschwindigkeit über Grund [km/h]", None),
        ("Giergeschwindigkeit [°/s]", "imu.yaw_rate"),
        ("Drehvorgabe [°/s]", "cmd.omega"),
        ("Drehvorgabe [1/min]", None),
        ("w_cmd", "cmd.omega"),
        ("cmd_linear", "cmd.v"),
        ("omega_ref [rad/s]", "cmd.omega"),
        ("angular_velocity_setpoint", "cmd.omega"),
        ("target_yaw_rate [deg/s]", "cmd.omega"),
        ("omega_cmd [rpm]", None),
        ("w_pump_cmd", None),
        ("gyro_z", "imu.yaw_rate"),
        ("gyro_z_rad_s", "imu.yaw_rate"),
        ("angular_velocity_z", "imu.yaw_rate"),
        ("gyro_x", None),
        ("imu_acc_x [g]", "imu.acceleration"),
        ("linear_acceleration_x", "imu.acceleration"),
        ("accel_x [m/s^2]", "imu.acceleration"),
        ("MAIN.fbImu.fAccelX [m/s²]", "imu.acceleration"),
        ("acc_y", None),
        ("cmd_accel_x", None),
        ("wheel_acc_x", None),
        ("cmd_gyro_z", None),
        ("Kran_Drehvorgabe [°/s]", None),
        ("PropVentil VR Kolbenweg [%]", "wheel.FR.u_applied"),
        ("Ventilöffnung Soll VL [%]", "wheel.FL.u"),
        ("Ventilöffnung Ist VL [%]", "wheel.FL.u_applied"),
        ("Ventilöffnungsgrad HR Sollwert [%]", "wheel.RR.u"),
        ("Istöffnung Ventil VL [%]", "wheel.FL.u_applied"),
        ("Ventilöffnungszeit VL [ms]", None),
        ("Lenkventil Öffnung VA [%]", "steer.front.u"),
        ("valve opening FL [%]", "wheel.FL.u"),
        ("Valve opening actual RL [%]", "wheel.RL.u_applied"),
        ("measured valve FR [%]", "wheel.FR.u_applied"),
        ("consigne ouverture vanne ARD [%]", "wheel.RR.u"),
        ("ouverture mesurée vanne ARD [%]", "wheel.RR.u_applied"),
        ("Ventilhub_HL [%]", "wheel.RL.u_applied"),
        ("Zylinder VL Kolbenweg [%]", None),
        ("Lüfter_Geschwindigkeit_soll [m/s]", None),
        ("Diesel_Drehzahl_soll [1/min]", None),
        ("Drehzahlfehler_VR [1/min]", None),
        ("n_max_VR [1/min]", None),
        ("Abweichung_soll_ist_VR [1/min]", None),
        ("Öltemperatur_VR [°C]", None),
        ("p_Pumpe [bar]", None),
        ("vitesse_mesure_AVG (tr/min)", "wheel.FL.v"),
        ("consigne vitesse roue ARD (tr/min)", "wheel.RR.v_ref"),
        ("vitesse roue arrière gauche mesurée (tr/min)", "wheel.RL.v"),
        ("consigne_vitesse_AVD (tr/min)", "wheel.FR.v_ref"),
        ("vanne_AVD (%)", "wheel.FR.u"),
        ("angle_consigne_AV (°)", "steer.front.phi_ref"),
        ("angle_mesure_AR (°)", "steer.rear.phi"),
        ("consigne_vitesse (km/h)", "cmd.v"),
        ("consigne_lacet (°/s)", "cmd.omega"),
        ("vitesse_pompe_consigne (tr/min)", None),
        ("speed_fl_setpoint (rpm)", "wheel.FL.v_ref"),
        ("fl_actual_speed [rpm]", "wheel.FL.v"),
        ("max_speed_fl [m/s]", None),
        ("drv_fr_spd_act_mps", "wheel.FR.v"),
        ("drv_rl_spd_cmd_mps", "wheel.RL.v_ref"),
        ("drv_fl_vlv_cmd_pct", "wheel.FL.u"),
        ("drv_fl_vlv_pos_pct", "wheel.FL.u_applied"),
        ("str_f_ang_act_deg", "steer.front.phi"),
        ("str_r_ang_cmd_deg", "steer.rear.phi_ref"),
        ("str_r_vlv_cmd_pct", "steer.rear.u"),
        ("str_f_text", None),
        ("Fahrantrieb VR Ventilansteuerung [%]", "wheel.FR.u"),
        ("Fahrantrieb HL Schieberposition [%]", "wheel.RL.u_applied"),
        ("Drive/FL valve current [mA]", None),
        ("Fahrantrieb VL Ventilstrom [mA]", None),
        ("Fahrantrieb VL Strom [A]", "wheel.FL.effort"),
        ("DB_Antrieb_VR.Strom_Proportionalventil [mA]", None),
        ("Wheels/Wheel 2 demanded speed [m/s]", "wheel.FL.v_ref"),
        ("Valves/Valve 3 command [%]", "wheel.RR.u"),
        ("Valves/Valve 3 spool position [%]", "wheel.RR.u_applied"),
        ("roue_avant_droite_commande_vanne_pct", "wheel.FR.u"),
        ("velocidad_rueda_delantera_izquierda [rad/s]", "wheel.FL.v"),
        ("velocita_ruota_posteriore_destra [rad/s]", "wheel.RR.v"),
        ("velocidade_roda_traseira_esquerda [rad/s]", "wheel.RL.v"),
        ("snelheid_wiel_rechtsachter [rad/s]", "wheel.RR.v"),
        ("hastighet_hjul_fram_vänster [rad/s]", "wheel.FL.v"),
        ("hastighed_hjul_bagest_højre [rad/s]", "wheel.RR.v"),
        ("pyörä_etu_vasen_nopeus [rad/s]", "wheel.FL.v"),
        ("predkosc_koło_tylne_prawe [rad/s]", "wheel.RR.v"),
    ],
)
def test_columns(name: str, signal: str | None) -> None:
    assert [s for s, _ in found(column(name))] == ([] if signal is None else [signal])


@pytest.mark.parametrize(
    ("name", "unit", "signal"),
    [
        ("GVL_Fahren.fbRad_VR.nSoll", "1/min", "wheel.FR.v_ref"),
        ("GVL_Fahren.fbRad_VR.nIst", "1/min", "wheel.FR.v"),
        ("MAIN.stSollwerte.nDrehzahl_HL", "1/min", "wheel.RL.v_ref"),
        ("MAIN.stRad_HL.Soll.Drehzahl", "1/min", "wheel.RL.v_ref"),
        ("MAIN.stRad_HL.Ist.Drehzahl", "1/min", "wheel.RL.v"),
        ("MAIN.Drehzahl.VL", "1/min", "wheel.FL.v"),
        ("GVL_Fahren.fbRad_VR.nIst", None, None),
        ("GVL_Fahren.fbRad_VR.nIst", "°C", None),
        ("GVL_Fahren.rVSoll", "km/h", "cmd.v"),
        ("MAIN.fbVentilVL.fSollwert", "%", "wheel.FL.u"),
        ("MAIN.fbVentilVL.fRueckmeldung", "%", "wheel.FL.u_applied"),
        ("MAIN.fbRad_VL.rSchlupf", "%", None),
        ("MAIN.fbRad_VL.rSoll", "%", None),
        ("MAIN.Dieselmotor.rSolldrehzahl", "1/min", None),
        ("Axes.Axis_FL.NcToPlc.ActVelo", "mm/s", "wheel.FL.v"),
        ("Axes.Axis_FL.NcToPlc.SetVelo", "mm/s", "wheel.FL.v_ref"),
        ("GVL_Fahren.fbRad_VR.rVentilSoll", "%", "wheel.FR.u"),
        ("GVL_Lenken.fbAchse_VA.rWinkelIst", "°", "steer.front.phi"),
        ("GVL_Lenken.fbAchse_VA.rIst", "°", "steer.front.phi"),
    ],
)
def test_symbols(name: str, unit: str | None, signal: str | None) -> None:
    assert [s for s, _ in found(symbol(name, unit))] == ([] if signal is None else [signal])


def message(name: str, kind: str = "acme_msgs/msg/Chassis") -> Channel:
    topic, _, field = name.partition(".")
    return Channel(name, topic, field, STAMPS, np.zeros(3), None, kind)


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("/chassis/state.fl_rpm", "wheel.FL.v"),
        ("/chassis/state.rear_right_speed", "wheel.RR.v"),
        ("/chassis/command.fl_rpm", "wheel.FL.v_ref"),
        ("/wheel_command.fl_speed", "wheel.FL.v_ref"),
        ("/chassis/setpoints.speed_fl", "wheel.FL.v_ref"),
        ("/chassis/state.steer_front_deg", "steer.front.phi"),
        ("/chassis/state.wheels[1].speed", "wheel.FR.v"),
        ("/chassis/state.header.stamp.sec", None),
        ("/chassis/state.speed_fl_covariance[0]", None),
        ("/battery/state.current", None),
    ],
)
def test_fields_of_messages_of_ones_own(name: str, signal: str | None) -> None:
    assert [s for s, _ in found(message(name))] == ([] if signal is None else [signal])


def test_arrays_of_measured_and_asked_speeds() -> None:
    names = [f"/rover/{t}.data[{i}]" for t in ("wheel_velocities", "wheel_setpoints") for i in range(4)]
    channels = {n: message(n, "std_msgs/msg/Float64MultiArray") for n in names}
    signals = [c.signal for c in candidates(channels, haulotte())]
    assert signals == [f"wheel.{w}.{leaf}" for leaf in ("v", "v_ref") for w in haulotte().wheels]


def test_a_battery_is_no_drive_of_a_machine_with_one() -> None:
    one = replace(haulotte(), wheels=("D",), geometry=None)
    channel = message("/battery/state.current")
    assert not [*candidates({channel.name: channel}, one)]


def test_currents_of_valves_are_known_for_what_they_are() -> None:
    machine = haulotte()
    assert valve_current(column("Drive/FL valve current [mA]"), machine, {}) == "wheel.FL.u"
    assert valve_current(column("Ventilstrom Lenkung hinten [mA]"), machine, {}) == "steer.rear.u"
    assert valve_current(column("fVentil_Soll_VL [mA]"), machine, {}) == "wheel.FL.u"
    assert valve_current(column("fVentil_Soll_VL [%]"), machine, {}) is None
    assert valve_current(column("Drive/FL motor current [A]"), machine, {}) is None
    numbered = symbol("GVL.stAntrieb[3].fVentilstrom", "mA")
    assert valve_current(numbered, machine, {"GVL.stAntrieb[].fVentilstrom": 1}) == "wheel.RR.u"


def test_a_caster_steers_no_wheel() -> None:
    assert not is_steering("caster_swivel")
    assert is_steering("front_swivel")


def test_what_is_asked_is_never_taken_for_what_is_measured() -> None:
    words = ("soll", "Sollwert", "Vorgabe", "consigne", "ref", "cmd", "setpoint", "target", "desired")
    names = [
        t.format(w)
        for w in words
        for t in ("Drehzahl_VL_{}", "{}_Drehzahl_VL", "speed_{}_fl", "{}.Drehzahl.VL", "n_{}_VL")
    ]
    for name in names:
        assert {s for s, _ in found(column(f"{name} [1/min]"))} <= {"wheel.FL.v_ref"}, name


def test_the_unit_of_a_numbered_symbol_stays_and_the_name_of_a_part_is_none() -> None:
    assert found(symbol("GVL.stWheels[1].rRpmSetpoint", "U/min")) == [("wheel.FR.v_ref", "U/min")]
    assert found(symbol("GVL.stWheels[1].rRpm", "Umdrehungen")) == [("wheel.FR.v", "Umdrehungen")]
    assert found(column("speed[FL]")) == [("wheel.FL.v", "")]


def test_units_in_names() -> None:
    assert bare_name("n_ist_VR [1/min]") == ("n_ist_VR", "1/min")
    assert bare_name("n_ist_VR (U/min)") == ("n_ist_VR", "U/min")
    assert bare_name("n_ist_VR 1/min") == ("n_ist_VR", "1/min")
    assert bare_name("velocity[front_left_wheel]") == ("velocity[front_left_wheel]", "")
    assert bare_name("fbWheel[1]") == ("fbWheel[1]", "")
    assert found(column("n_ist_VR_U_min")) == [("wheel.FR.v", "rpm")]
    assert found(column("velocity[front_left_wheel]")) == [("wheel.FL.v", "")]
    assert (unit_by_end("nSpeedRpm"), unit_by_end("fVelKmh")) == ("rpm", "km/h")
    assert (unit_by_end("speed_kmh"), unit_by_end("RPM"), unit_by_end("RPM", doubtful=True)) == ("km/h", "", "rpm")


@pytest.mark.parametrize(
    ("name", "signal", "unit"),
    [
        ("yaw_rate_radps", "imu.yaw_rate", "rad/s"),
        ("yaw_rate_degps", "imu.yaw_rate", "deg/s"),
        ("yaw_rate", "imu.yaw_rate", ""),
        ("cmd_yaw_rate_radps", "cmd.omega", "rad/s"),
        ("odom_yaw_rate_radps", None, ""),
        ("speed_cmd_mps", "cmd.v", "m/s"),
        ("fFahrSollwert [km/h]", "cmd.v", "km/h"),
        ("Fahrzeug [km/h]", None, ""),
        ("front_left_wheel_speed_mm_s", "wheel.FL.v", "mm/s"),
        ("front_left_wheel_cmd_mps", "wheel.FL.v_ref", "m/s"),
        ("front_left_wheel_speed_rad_per_s", "wheel.FL.v", "rad/s"),
        ("front_left_wheel_setpoint_radps", "wheel.FL.v_ref", "rad/s"),
    ],
)
def test_units_that_are_written_as_a_word(name: str, signal: str | None, unit: str) -> None:
    assert found(column(name)) == ([] if signal is None else [(signal, unit)])


@pytest.mark.parametrize("names", ["w{}_rpm", "m{}_speed"])
def test_wheels_that_are_a_letter_with_a_number(names: str) -> None:
    channels = {n: column(n) for n in (names.format(i) for i in range(4))}
    assert [c.signal for c in candidates(channels, haulotte())] == [f"wheel.{w}.v" for w in haulotte().wheels]


def test_words() -> None:
    assert folded("Stellgröße, arrière") == "Stellgroesse, arriere"
    assert tokens("rLenkwinkelSoll_VA") == ["lenk", "winkel", "soll", "va"]
    assert english(tokens("Stellgröße_HR")) == ["valve", "cmd", "hr"]
    assert english(tokens("cmd_omega_rad_s")) == ["cmd", "omega", "rad", "s"]
    assert [role(english(tokens(n))) for n in ("n_soll", "n_ist", "soll_ist", "n")] == ["ref", "act", "both", ""]


@pytest.mark.parametrize(
    ("name", "signals"),
    [
        ("odom_v [m/s]", ["odom.v"]),
        ("odom_linear_x", ["odom.v"]),
        ("odometry_speed [km/h]", ["odom.v"]),
        ("odom.twist.twist.linear.x", ["odom.v"]),
        ("odom_linear_vel", ["odom.v"]),
        ("odometry_linear_velocity_x [m/s]", ["odom.v"]),
        ("odom_x_vel", ["odom.v"]),
        ("speed_odom", ["odom.v"]),
        ("v_odom [mm/s]", ["odom.v"]),
        ("odom_forward_speed", ["odom.v"]),
        ("robot.odom.vx", ["odom.v"]),
        ("odom_angular_v", []),
        ("odom_angular_velocity_z", []),
        ("odom_x", []),
        ("odom_pose_x", []),
        ("odom_vy", []),
        ("odom_yaw_speed", []),
        ("odom_v_error", []),
        ("odom_speed_max", []),
        ("wheel_odom_left_speed", []),
        ("angular_speed_odom", []),
        ("odom_linear_y", []),
        ("odom_speed_cmd", []),
    ],
)
def test_a_tables_odometry_is_the_measured_speed_of_the_machine(name: str, signals: list[str]) -> None:
    found = [c.signal for c in candidates({name: column(name)}, haulotte())]
    assert [s for s in found if s.startswith("odom")] == signals


@pytest.mark.parametrize(
    ("name", "signal", "unit"),
    [
        ("wheel_rpm_FL", "wheel.FL.v", "rpm"),
        ("RPM_FR", "wheel.FR.v", "rpm"),
        ("speed_kmh_rear_left", "wheel.RL.v", "km/h"),
        ("yaw_rate_deg_s", "imu.yaw_rate", "deg/s"),
        ("YawRate_rad_s", "imu.yaw_rate", "rad/s"),
        ("yaw_rate_cmd_deg_s", "cmd.omega", "deg/s"),
        ("FLspeed_kmh", "wheel.FL.v", "km/h"),
        ("RRspeed", "wheel.RR.v", ""),
    ],
)
def test_units_within_a_name_and_places_written_with_a_word(name: str, signal: str, unit: str) -> None:
    assert found(column(name)) == [(signal, unit)]


@pytest.mark.parametrize("name", ["{}speed", "{}speed_cmd", "{}_speed_cmd", "{}Speed_cmd"])
def test_a_side_before_its_word_is_of_one_wheel_and_never_the_machine(name: str) -> None:
    two = Machine("two", "", ("R", "L"), None)
    signal = "v_ref" if "cmd" in name else "v"
    for side in ("R", "L"):
        channel = column(name.format(side))
        assert [c.signal for c in candidates({channel.name: channel}, two)] == [f"wheel.{side}.{signal}"]


@pytest.mark.parametrize("name", ["Left", "Reference", "Level", "Radar_speed_max", "lrSpeed_soll", "Rate"])
def test_words_that_begin_like_a_side_stay_as_they_are(name: str) -> None:
    assert not {"l", "r"} & {*tokens(name)}
