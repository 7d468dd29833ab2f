"""Topic repairs: one row per defect found in reviews, with the test or command that shows that it is repaired."""
import os
import subprocess
import tempfile

from figure_topics.rows import at_most, equals, reported
from figure_topics.tests import ROOT, run_test

# The tests are programs of the whole tree.
TEST_TARGETS = ["all"]

# The requirement; the ctest that checks it; the filter of its Google Tests (None: all); what is real in it.
PROMISES = [
    ("1 another certificate of the owner's intermediate is refused, and no token leaves",
     "e2e_security_test", "PinnedChainTest.*", "real daemon, gRPC and TLS; chains made by openssl"),
    ("1 certificates are renewed in service, streams go on",
     "grpc_security_test", "*TheCertificateIsRenewedWhileAStreamRuns:*AsSoonAsItsClockIsSet*",
     "real gRPC and TLS, a clock of the test's own"),
    ("1 keys in service: renewed, read again, never replaced by keys that no client knows",
     "link_access_test", "ReloadingKeysTest.*", "real OpenSSL"),
    ("1 links, second names, FIFOs and folders in place of private files are refused",
     "link_access_test", "*HostileFiles*:*HostileClientList*:*SymbolicLink*", "real files"),
    ("1 the same for every file that is opened in another user's folder",
     "proto_files_test", "Files.*", "real files"),
    ("1 sessions that were never begun do not close a pairing window",
     "grpc_security_test", "*InventedSessions*", "real gRPC and TLS"),
    ("1 a pairing exchange seals once", "pairing_test", None, "values alone"),
    ("1 a mistake in the client list keeps the last good one, is said and counted",
     "link_access_test", "ClientListTest.*", "real files"),
    ("1 paired credentials outlast a power cut",
     "host_sdk_test", "CredentialStore.OutlastsAPowerCut", "calls of fsync and rename, recorded"),
    ("1 an MQTT login over plain text is refused unless it is asked for by name",
     "proto_files_test", "Config.ALogin*:MqttAddress.Says*", "values alone"),
    ("1 the same at the daemon's link", "mqtt_link_test", "*InvalidConfiguration*", "real Mosquitto"),
    ("1 the same at the SDK's link", "mqtt_source_test", "*ALogin*", "real Mosquitto"),
    ("1 names from the network forge no line", "app_test", "Log.*", "real daemon's log"),
    ("1 the same in the command line's output", "lightwell_cli_test", "*WhatAProbeSays*", "real program"),
    ("2 the README's tables are what the .proto files say", "wire_tables", None, "protoc"),
    ("2 a decoder written from the prose alone agrees with every golden vector and 7,200 damaged messages",
     "wire_decoder_test", None, "Python without protobuf"),
    ("3 two clients change different fields, both hold",
     "e2e_light_test", "*TwoClientsChangeDifferentFields*", "real daemon, gRPC"),
    ("3 two updates at once, none is lost", "app_test", "*ConcurrentUpdates*", "real threads"),
    ("3 a client reads the configuration, and nothing else of the daemon's",
     "grpc_link_test", "*GetConfigReturns*:*UnknownFields*:*SetConfigRefusesInvalidValues*", "real gRPC"),
    ("3 a change sends its own fields alone", "host_sdk_links_test", "*AChangeSends*:*WhatAnOldProbe*", "real gRPC"),
    ("3 lightwell config get, set", "e2e_light_test", "*TheToolReads*", "real daemon and program"),
    ("3 from C", "c_questions_test", None, "liblightwell.so"),
    ("3 from Python", "e2e_python_package_test", None, "the package, real daemon"),
    ("3 from C#", "csharp_test", None, "Mono"),
    ("4 what an estimator lacks is refused by name; deprecated fields warn",
     "proto_files_test", "Config.AnOption*:Config.AnEstimator*:Config.Deprecated*", "values alone"),
    ("4 the same over the link",
     "grpc_link_test", "GrpcServiceTest.SetConfigRefusesInapplicableFields*", "real gRPC"),
    ("4 a budget that nothing can keep is refused with a marker",
     "e2e_life_test", "BadInputTest.ABudgetForTheMarker*", "real daemon"),
    ("4 the marker's coverage is a share of directions", "marker_light_test", "SphereCoverage*", "closed forms"),
    ("4 tracks are followed in time, at any frame rate", "estimate_common_test", "LightTracker*", "values alone"),
    ("5 rows that are known to fall short are named, and excuse no other", "figures_test", None, "values alone"),
    ("5 without a frame rate a camera pushes what the estimator takes",
     "e2e_life_test", "BudgetTest.WithoutAFrameRate*", "real daemon, simulated camera"),
    ("6 no black reflections on eight panoramas at any roughness", "reflections_test", None, "real panoramas, oracle"),
    ("6 radiance() is never negative, nor black beside a lamp",
     "proto_numbers_test", "Reconstruction.*", "random and hostile harmonics"),
    ("6 languages agree", "typescript_test", None, "Node"),
    ("7 cmake/setup takes what it is for", "packages", None, "the list of packages"),
    ("7 the installed service is sandboxed: exposure below 3", "install_service", None, "systemd-analyze"),
    ("8 C++ is laid out as .clang-format says, no line is over 120 columns", "code_layout", None, "clang-format 14"),
    ("9 geometry: honest sigmas, bent boards, models that pictures do not determine",
     "geometry_test", None, "simulated observations"),
    ("9 the same from files", "calibrate_geometry_test", None, "rendered pictures, real AprilTag"),
]


def promises(say):
    rows = []
    for name, test, chosen, real in PROMISES:
        say(f"{test} {chosen or ''}")
        rows.append(equals(f"{name}: {test} {chosen or ''}".strip(), 1, run_test(test, chosen)["passed"], "", real))
    return rows


def demo(say):
    """Measures a first build of the demo, without ccache, in a temporary folder."""
    say("preset demo, compiling without ccache (minutes)")
    real = "preset demo, g++, no ccache"
    setup = subprocess.run([ROOT / "cmake/setup", "demo", "--list"], stdout=subprocess.PIPE, text=True)
    packages = len(setup.stdout.split()) if setup.returncode == 0 else None
    rows = [at_most("7 packages that the demo installs on a bare Debian", 20, packages, "", "cmake/setup demo --list")]
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"CCACHE_DISABLE": "1"}
        targets = ["lightwelld", "lightwell_cli", "demo_report"]
        quiet = {"cwd": ROOT, "env": environment, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        configured = subprocess.run(["cmake", "--preset", "demo", "-B", folder], **quiet)
        before = os.times()
        built = subprocess.run(["ninja", "-C", folder, *targets], **quiet) if configured.returncode == 0 else None
        after = os.times()
    succeeded = built is not None and built.returncode == 0
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    objects = sum("Building CXX" in line for line in built.stdout.splitlines()) if succeeded else None
    rows.append(at_most("7 processor time of compiling the demo", 300, spent if succeeded else None, "s", real))
    rows.append(reported("7 objects of the demo", objects, "", real))
    return rows


def measure(_, say):
    return promises(say) + demo(say)
