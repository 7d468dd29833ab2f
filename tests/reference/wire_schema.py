"""The messages of a LightingDescriptor as wire_decoder.py reads them, written from the tables of proto/README.md."""

# Message name -> field number -> (name, type, whether repeated). A type that is a key of this table is a message.
SCHEMA = {
    "LightingDescriptor": {
        1: ("wire_version", "uint32", False), 2: ("sequence", "uint64", False), 3: ("time", "CaptureTime", False),
        4: ("units", "enum", False), 5: ("radiance", "SphericalHarmonics", False), 6: ("lights", "Light", True),
        7: ("environment", "EnvironmentMap", False), 8: ("unseen", "float", False), 9: ("saturated", "float", False),
        10: ("bound", "ErrorBound", False), 11: ("probe_id", "fixed32", False),
        12: ("calibration_id", "fixed32", False), 13: ("flags", "enum", True), 14: ("setting", "enum", False),
        15: ("flicker", "enum", False), 16: ("T_probe_origin", "Pose", False)},
    "CaptureTime": {
        1: ("mid_exposure_ns", "fixed64", False), 2: ("clock", "enum", False),
        3: ("delivered_after_us", "uint32", False), 4: ("encoded_after_us", "uint32", False)},
    "SphericalHarmonics": {
        1: ("bands", "uint32", False), 2: ("exponent", "sint32", False), 3: ("mantissa", "sint32", True)},
    "Light": {
        1: ("direction", "sint32", True), 2: ("irradiance_mantissa", "sint32", True),
        3: ("irradiance_exponent", "sint32", False), 4: ("angular_radius_e5", "uint32", False),
        5: ("covariance_mantissa", "sint32", True), 6: ("track", "uint32", False),
        7: ("covariance_exponent", "sint32", False), 8: ("distance_e4", "uint32", False),
        9: ("distance_sigma_e4", "uint32", False)},
    "EnvironmentMap": {
        1: ("key", "fixed32", False), 2: ("encoding", "enum", False), 3: ("levels", "Level", True),
        4: ("exponent", "sint32", False), 5: ("key_interval_ms", "uint32", False), 6: ("texels", "bytes", False),
        7: ("runs", "uint32", True), 8: ("light_tracks", "uint32", True), 9: ("light_runs", "uint32", True),
        10: ("light_texels", "bytes", False)},
    "Level": {1: ("edge", "uint32", False), 2: ("roughness", "float", False)},
    "ErrorBound": {
        1: ("total", "uint32", False), 2: ("truncation", "uint32", False), 3: ("sampling", "uint32", False),
        4: ("noise", "uint32", False), 5: ("quantization", "uint32", False), 6: ("smoothing", "uint32", False)},
    "Pose": {
        1: ("qx", "double", False), 2: ("qy", "double", False), 3: ("qz", "double", False), 4: ("qw", "double", False),
        5: ("tx", "double", False), 6: ("ty", "double", False), 7: ("tz", "double", False)},
}
