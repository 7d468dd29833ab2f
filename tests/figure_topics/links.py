"""Topic links: latency, recovery and endurance of every link, and the speed of the SDK's queries."""
import json
import pathlib
import subprocess

from figure_topics.rows import at_least, at_most, equals, reported
from figure_topics.skeleton import Probe
from figure_topics.tests import run_test

TARGETS = ["lightwelld", "lightwell_cli", "measure_queries", "measure_latency", "measure_recovery", "measure_day",
           "measure_mqtt", "measure_trade"]
# The tests of languages and consumers are programs of the whole tree.
TEST_TARGETS = ["all"]

# The ctests that are requirements, and what is real in them.
TESTS = [
    ("codec_test", "frozen messages of wire version 1, a newer probe's, damage"),
    ("pairing_test", "SPAKE2 against RFC 9382's published vectors"),
    ("link_messages_test", "frames and requests, damaged at random"),
    ("grpc_link_test", "real gRPC"),
    ("grpc_security_test", "real gRPC and TLS: tokens and certificates, missing, wrong, expired; hostile messages"),
    ("link_access_test", "real OpenSSL: keys, certificates, lists"),
    ("mqtt_link_test", "real Mosquitto"),
    ("web_link_test", "real libwebsockets, HTTP and frames written by hand: cut, oversized, slow, flooding"),
    ("web_security_test", "real TLS: tokens, certificates, the first message of browsers"),
    ("usb_gadget_test", "the gadget's port and link on sockets, without a controller"),
    ("usb_gadget_script_test", "the gadget's script on folders in place of configfs"),
    ("host_sdk_test", "values, conversions against oracles of the engines' documents"),
    ("host_sdk_links_test", "real gRPC, a probe of the test's own"),
    ("mqtt_source_test", "real Mosquitto, hostile publishers"),
    ("web_source_test", "scripted WebSocket servers"),
    ("usb_device_test", "real libusb, umockdev's device"),
    ("openxr_light_test", "Debian's OpenXR loader, a runtime of the test's own"),
    ("filament_light_test", "Filament's own library"),
    ("e2e_usb_test", "both ends of the USB link on a cable in memory: 10,000 events"),
    ("e2e_wire_test", "real daemon and client behind an impairing proxy; pictures looked for on the wire"),
    ("e2e_security_test", "real daemon, tool and TLS; pairing overheard and stood between"),
    ("e2e_web_source_test", "both ends of the web link in one process: pins, authorities, reconnection"),
    ("e2e_web_test", "real daemon and tool by WebSocket, pairing"),
    ("e2e_mqtt_test", "real daemon, Mosquitto and client"),
    ("e2e_discover_test", "real avahi-daemon on a bus of its own, real Mosquitto"),
    ("e2e_clients_test", "real daemon, clients as processes that stall and are killed"),
    ("e2e_python_client_test", "a client made from proto/ alone, Python's gRPC, real daemon"),
    ("e2e_python_package_test", "the Python package, real daemon"),
    ("c_symbols_test", "liblightwell.so as the linker sees it"),
    ("python_test", "CPython and NumPy, a recording"),
    ("csharp_test", "Mono, a recording"),
    ("typescript_test", "Node, recordings and golden messages"),
    ("install_consumer", "applications outside of the tree, in C++ and in C"),
    ("install_glm_consumer", "an application with GLM outside of the tree"),
]

PROCESSES = "real daemon, gRPC on loopback, clients in another process; simulated camera at 60 Hz"


def lines_of(command, say):
    say(" ".join(str(getattr(c, "name", c)) for c in command))
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    return (
        [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")] if done.returncode == 0 else []
    )


def by_figure(items):
    return {item["figure"]: item for item in items}


def queries(programs, say):
    """Absolute times, best of five; the memcpy speed of this run is printed with them."""
    figures = by_figure(lines_of([programs / "measure_queries"], say))
    value = lambda figure: figures.get(figure, {}).get("value")
    speed = next((item["memcpy_gb_per_s"] for item in figures.values()), None)
    vector = next((item["vector"] for item in figures.values()), None)
    real = f"real SDK, one thread, {vector}, best of five; memcpy {speed} GB/s"
    rows = [at_most("latest()", 100, value("latest_ns"), "ns", real),
            at_most("irradiance(), band 2, two lights", 50, value("irradiance_ns.band2.2"), "ns", real),
            at_least("normals at once, band 2", 200, value("normals_per_s.band2.0"), "million/s", real),
            reported("normals at once, band 2, two lights", value("normals_per_s.band2.2"), "million/s", real),
            reported("irradiance(), band 6, eight lights", value("irradiance_ns.band6.8"), "ns", real),
            reported("radiance(), band 4, two lights", value("radiance_ns"), "ns", real),
            reported("at(), interpolated", value("at_ns"), "ns", real),
            reported("rotated()", value("rotated_ns"), "ns", real)]
    return rows


def latency_runs(programs, uri, say):
    """Runs with one client, and with 100 of which 20 never read."""
    measure = [programs / "measure_latency", uri, "--repeats", "5", "--seconds"]
    return lines_of([*measure, "4"], say), lines_of([*measure, "6", "--clients", "80", "--stalled", "20"], say)


def latency(programs, say):
    rows = []
    with Probe(programs, "sim:city", "--frame-rate", "60", "--web", "127.0.0.1:0") as probe:
        web_address = probe.process.stdout.readline().split("listening on ")[1].strip()
        one, many = latency_runs(programs, probe.address, say)
        web_one, web_many = latency_runs(programs, web_address, say)
    best = lambda runs, key: min((run[key] for run in runs), default=None)
    speed = lambda runs: f"{PROCESSES}; best of five, memcpy {runs[0]['memcpy_gb_per_s']} GB/s" if runs else PROCESSES
    rows.append(at_most("publisher to latest(), one client, p50", 0.5, best(one, "p50"), "ms", speed(one)))
    rows.append(at_most("publisher to latest(), one client, p99", 3, best(one, "p99"), "ms", speed(one)))
    rows.append(
        at_most(
            "publisher to latest(), 100 clients of which 20 never read, p99 over all that read",
            10,
            best(many, "p99"),
            "ms",
            speed(many),
        )
    )
    web = lambda runs: speed(runs).replace("gRPC", "WebSocket")
    rows.append(at_most("the same by WebSocket, one client, p50", 0.5, best(web_one, "p50"), "ms", web(web_one)))
    rows.append(at_most("the same by WebSocket, one client, p99", 3, best(web_one, "p99"), "ms", web(web_one)))
    rows.append(at_most("the same by WebSocket, 100 clients of which 20 never read, p99 over all that read", 10,
                        best(web_many, "p99"), "ms", web(web_many)))
    rows.append(
        at_least(
            "descriptors coalesced for those that never read, least of five runs",
            1,
            best(many, "coalesced"),
            "",
            PROCESSES,
        )
    )
    rows.append(equals("captures that the probe lost beside them, over all runs", 0,
                       sum(run["captures_dropped"] for run in many) if many else None, "", PROCESSES))
    rows.append(
        equals(
            "gaps of the clients that read, over all runs",
            0,
            sum(run["gaps"] for run in many) if many else None,
            "",
            PROCESSES,
        )
    )
    return rows


def recovery(programs, say):
    with Probe(programs, "sim:city", "--frame-rate", "60") as probe:
        figures = by_figure(lines_of([programs / "measure_recovery", probe.address], say))
    real = "real daemon and client, impairing proxy of the tests' own"
    value = lambda figure: figures.get(figure, {}).get("value")
    names = {
        "cut.10": "light back after a cut of 10 s, largest of three",
        "held.10": "light back after 10 s of silence, half open, largest of three",
        "delayed": "light fresh after 200 ms of delay and jitter ended",
    }
    rows = [at_most(name, 1, value(figure), "s", real) for figure, name in names.items()]
    rows.append(equals("answers called valid that were older than max_age", 0,
                       sum(item["lies"] for item in figures.values()) if figures else None, "", real))
    return rows


def day(programs, say):
    figures = {k: v["value"] for k, v in by_figure(lines_of([programs / "measure_day"], say)).items()}
    real = "real publisher, gRPC and clients in one process; 24 h of descriptors at 30 a second, time compressed"
    get = figures.get
    grown = lambda what: None if get(f"{what}.settled") is None else get(f"{what}.last") - get(f"{what}.settled")
    return [
        equals("descriptors of a day", 24 * 3600 * 30, get("published"), "", real),
        # The allocator's pools grow ever more slowly (over 60 hours 1.2 MB, half of it in the first nine). A leak of
        # every thousandth descriptor would be 600 kB in half a day.
        at_most(
            "memory after a day, over that at noon",
            600,
            None if get("rss_kb.half") is None else get("rss_kb.last") - get("rss_kb.half"),
            "kB",
            real,
        ),
        reported("memory after a day, over the largest of the first three hours", grown("rss_kb"), "kB", real),
        at_most("file handles after a day, over those of the first three hours", 0, grown("fds"), "", real),
        at_most(
            "threads after a day, over those of the first three hours, without gRPC's pools",
            0,
            grown("threads"),
            "",
            real,
        ),
        # gRPC starts threads when calls coincide, even after hours; its executors have at most two threads per core.
        at_most(
            "threads of the largest of gRPC's pools, at any look",
            get("pool_threads.bound", 0),
            get("pool_threads.most"),
            "",
            real,
        ),
        equals("reconnects of the client that stays", 0, get("reconnects"), "", real),
        reported("descriptors that it received", get("received"), "", real),
    ]


def venue(programs, say):
    if not (programs / "measure_mqtt").exists():
        return [reported("MQTT, 1,000 subscribers: rate at the knee", None, "1/s", "measure_mqtt was not built")]
    figures = {k: v.get("value") for k, v in by_figure(lines_of([programs / "measure_mqtt"], say)).items()}
    real = "real Mosquitto, 1,000 subscribers in one process, QoS 0"
    get = lambda name: figures.get(f"mqtt.1000.{name}")
    rows = [reported("MQTT, 1,000 subscribers: rate at the knee", get("knee_descriptors_per_s"), "descriptors/s", real),
            reported("MQTT, 1,000 subscribers: deliveries at the knee", get("knee_deliveries_per_s"), "1/s", real),
            reported("MQTT, 1,000 subscribers: p50 at the knee", get("knee_p50_ms"), "ms", real),
            reported("MQTT, 1,000 subscribers: p99 at the knee", get("knee_p99_ms"), "ms", real)]
    steps = [k.split(".")[2] for k in figures if k.endswith(".p99_ms")]
    rows += [
        reported(
            f"MQTT, 1,000 subscribers, {step.replace('_', ' ')} descriptors/s: p99", get(f"{step}.p99_ms"), "ms", real
        )
        for step in steps
    ]
    return rows


def trade(programs, say):
    picture = pathlib.Path("out/sdk_trade.png").resolve()
    picture.parent.mkdir(exist_ok=True)
    items = lines_of([programs / "measure_trade"], say)
    real = f"eight real panoramas, ideal camera, over the wire; {picture}"
    # Debian's interpreter has Debian's matplotlib.
    chart = ["/usr/bin/python3", pathlib.Path(__file__).with_name("trade_chart.py"), picture]
    if items and subprocess.run(chart, input=json.dumps(items), text=True).returncode:
        items = []
    return [
        reported(
            f"{item['figure']}: {item['bytes_per_s']:.0f} B/s, {item['irradiance_ns']:.0f} ns, silver ball "
            f"{item['silver_percent']:.1f} %",
            item["irradiance_percent"],
            "% irradiance error",
            real,
        )
        for item in items
    ] or [reported("trade", None, "", real)]


def tests_pass(say):
    """One row for each test. One that did not run, or was skipped, does not hold."""
    rows = []
    for name, real in TESTS:
        say(name)
        rows.append(equals(f"{name}: passes", 1, run_test(name)["passed"], "", real))
    return rows


def measure(programs, say):
    return (
        queries(programs, say)
        + latency(programs, say)
        + recovery(programs, say)
        + day(programs, say)
        + venue(programs, say)
        + trade(programs, say)
        + tests_pass(say)
    )
