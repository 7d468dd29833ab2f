"""Self-test of include_direction.py: a tree that keeps every rule, and one file for each way to break one.

The expectations are written by hand from CONTRIBUTING.md, not derived from arrows.txt, so that a wrong line in
arrows.txt fails this test, too.
"""

from include_direction import Checker

# File -> its #include lines: every dependency that CONTRIBUTING.md allows.
CLEAN = {
    "proto/include/lightwell/sh.hpp": ["<array>", "<cmath>", "<lightwell/geometry.hpp>"],
    "proto/include/lightwell/geometry.hpp": ["<stdint.h>"],
    "proto/src/codec.cpp": ["<lightwell/sh.hpp>", '"wire.hpp"', '"lightwell/v1/descriptor.pb.h"',
                            "<google/protobuf/text_format.h>", "<vector>"],
    "proto/src/wire.hpp": ["<span>"],
    "proto/firmware/include/lightwell/config.hpp": ["<string>", "<lightwell/sh.hpp>"],
    "proto/firmware/src/config.cpp": ["<lightwell/config.hpp>", "<lightwell/sh.hpp>", '"text.hpp"', '"wire.hpp"',
                                      '"lightwell/v1/config.pb.h"', "<google/protobuf/text_format.h>"],
    "proto/firmware/src/text.hpp": ["<google/protobuf/message.h>"],
    "proto/src/pairing/key.cpp": ["<openssl/evp.h>", '"lightwell/sh.hpp"'],
    "firmware/imaging/frame.hpp": ["<lightwell/geometry.hpp>", "<span>"],
    "firmware/camera/backends/table.hpp": ['"imaging/frame.hpp"'],
    "firmware/camera/backends/sim/sim.cpp": ['"imaging/frame.hpp"', '"sim/scene.hpp"',
                                             '"calibration/model/camera_model.hpp"', '"sim.hpp"',
                                             "<lightwell/sh.hpp>"],
    "firmware/camera/backends/sim/sim.hpp": ['"imaging/frame.hpp"'],
    "firmware/camera/backends/v4l2/v4l2.cpp": ["<linux/videodev2.h>", '"imaging/frame.hpp"'],
    "firmware/camera/backends/v4l2/v4l2.hpp": [],
    "firmware/camera/backends/libcamera/a.cpp": ["<libcamera/libcamera.h>"],
    "firmware/camera/backends/depthai/a.cpp": ["<depthai/depthai.hpp>"],
    "firmware/calibration/model/camera_model.hpp": ['"imaging/frame.hpp"', "<Eigen/Core>"],
    "firmware/calibration/solve/import/chain.hpp": ["<yaml-cpp/yaml.h>"],
    "firmware/calibration/solve/bundle.cpp": ["<ceres/ceres.h>", "<opencv2/core.hpp>", '"imaging/frame.hpp"',
                                              '"calibration/model/camera_model.hpp"'],
    "firmware/sim/scene.hpp": ['"imaging/frame.hpp"', '"calibration/model/camera_model.hpp"'],
    "firmware/pose/tag.hpp": ["<lightwell/config.hpp>"],
    "firmware/pose/tag.cpp": ['"pose/tag.hpp"', '"imaging/frame.hpp"', '"calibration/model/camera_model.hpp"',
                              "<apriltag/apriltag.h>", "<ceres/ceres.h>"],
    "firmware/estimate/common/lights.hpp": ["<lightwell/sh.hpp>"],
    "firmware/estimate/frames/rows.hpp": ['"imaging/frame.hpp"', '"calibration/model/camera_model.hpp"',
                                          '"estimate/common/lights.hpp"'],
    "firmware/estimate/marker/fit.cpp": ["<ceres/ceres.h>", '"estimate/common/lights.hpp"',
                                         '"estimate/frames/rows.hpp"', '"imaging/frame.hpp"',
                                         '"calibration/model/camera_model.hpp"'],
    "firmware/estimate/specular/fit.cpp": ["<ceres/ceres.h>"],
    "firmware/link/link.hpp": ["<lightwell/sh.hpp>", "<lightwell/config.hpp>"],
    "firmware/link/grpc/server.cpp": ["<grpcpp/grpcpp.h>", '"lightwell/v1/service.grpc.pb.h"',
                                      '"link/link.hpp"', "<grpc/grpc.h>"],
    "firmware/link/discovery/advertiser.cpp": ["<avahi-client/client.h>"],
    "firmware/app/pipeline.cpp": ['"camera/backends/sim/sim.hpp"', '"link/link.hpp"',
                                  '"pose/tag.hpp"', '"sim/scene.hpp"', "<CLI/CLI.hpp>"],
    "firmware/app/pipeline.hpp": [],
    "firmware/tools/eval.cpp": ['"app/pipeline.hpp"', '"estimate/common/lights.hpp"', "<nlohmann/json.hpp>"],
    "host_sdk/include/lightwell/probe.hpp": ["<lightwell/sh.hpp>", "<lightwell/lightwell.h>"],
    "host_sdk/include/lightwell/lightwell.h": ["<stdint.h>"],
    "host_sdk/include/lightwell/glm.hpp": ["<glm/vec3.hpp>", "<lightwell/sh.hpp>"],
    "host_sdk/src/core/store.hpp": ["<lightwell/probe.hpp>", "<atomic>"],
    "host_sdk/src/core/link_grpc.cpp": ["<grpcpp/grpcpp.h>", '"lightwell/v1/service.grpc.pb.h"',
                                        '"core/store.hpp"'],
    "firmware/link/usb_gadget/ffs.cpp": ["<linux/usb/functionfs.h>", '"link/link.hpp"'],
    "host_sdk/src/c/handle.hpp": ["<lightwell/lightwell.h>", "<lightwell/probe.hpp>"],
    "host_sdk/src/core/link_usb.cpp": ["<libusb-1.0/libusb.h>"],
    "proto/src/mqtt_session.cpp": ["<mosquitto.h>", "<mqtt_protocol.h>"],
    "proto/src/platform/files_posix.cpp": ["<fcntl.h>", "<unistd.h>", "<sys/stat.h>", "<lightwell/sh.hpp>"],
    "proto/src/platform/files_windows.cpp": ["<windows.h>", "<io.h>"],
    "proto/src/platform/sockets.hpp": ["<netdb.h>", "<winsock2.h>"],
    "host_sdk/src/core/avahi_library.hpp": ["<avahi-client/lookup.h>"],
    "host_sdk/src/field/fit.cpp": ["<ceres/ceres.h>", '"core/store.hpp"', "<opencv2/core.hpp>"],
    "host_sdk/src/field/fit.hpp": [],
    "host_sdk/examples/openxr_light/main.cpp": ["<openxr/openxr.h>", "<lightwell/probe.hpp>"],
    "host_sdk/openxr_layer/estimator.cpp": ["<openxr/openxr.h>", "<lightwell/lightwell.h>", "<lightwell/geometry.hpp>"],
    "host_sdk/src/image_object/view.cpp": ['"image_object/view.hpp"', '"core/store.hpp"'],
    "host_sdk/src/rays/trace.cpp": ["<embree3/rtcore.h>", "<lightwell/geometry.hpp>"],
    "host_sdk/src/relight/trace.cpp": ['"rays/trace.hpp"', '"core/store.hpp"'],
    "host_sdk/tools/ar_viewer/context.cpp": ["<epoxy/gl.h>", "<GLFW/glfw3.h>", "<imgui.h>", '"ar_viewer/scene.hpp"',
                                             "<glm/glm.hpp>"],
    "host_sdk/tools/ar_viewer/scene.hpp": ["<lightwell/probe.hpp>"],
    "host_sdk/tools/ar_viewer/mesh_gltf.cpp": ["<tiny_gltf.h>"],
    "host_sdk/tools/ar_viewer/picture.cpp": ["<OpenEXR/ImfHeader.h>"],
    "host_sdk/tools/viewer.cpp": ["<apriltag/tag36h11.h>", "<opencv2/imgproc.hpp>", "<nlohmann/json.hpp>",
                                  "<lightwell/probe.hpp>", '"core/store.hpp"'],
    "tests/support/image.hpp": ["<vector>"],
    "tests/proto/sh_test.cpp": ["<lightwell/sh.hpp>", '"support/image.hpp"', "<gtest/gtest.h>",
                                '"lightwell/v1/descriptor.pb.h"'],
    "tests/firmware/camera/frame_test.cpp": ['"imaging/frame.hpp"', '"support/image.hpp"',
                                             "<linux/videodev2.h>"],
    "tests/host_sdk/store_test.cpp": ["<lightwell/probe.hpp>", '"core/store.hpp"'],
    "tests/e2e/whole_test.cpp": ['"app/pipeline.hpp"', "<lightwell/probe.hpp>"],
    "hil/demo.cpp": ['"sim/scene.hpp"', "<lightwell/probe.hpp>", "<opencv2/core.hpp>"],
}

NO_INCLUDES = '''// #include <ceres/ceres.h>
/* #include <ceres/ceres.h>
#include "app/pipeline.hpp"
*/
// backends/*.hpp opens no comment
const char* url = "http://x/*y";
const char* text = R"(
#include "app/pipeline.hpp"
)";
'''

# File, its #include lines (the last one breaks a rule), and a part of the text of each rule that must be reported.
BROKEN = [
    ("proto/include/lightwell/a.hpp", ["<lightwell/probe.hpp>"],
     ["proto depends on nothing", "firmware and proto do not depend"]),
    ("proto/include/lightwell/b.hpp", ['"imaging/frame.hpp"'], ["proto depends on nothing"]),
    ("proto/include/lightwell/c.hpp", ["<Eigen/Core>"], ["installed headers"]),
    ("proto/include/lightwell/d.hpp", ["<glm/vec3.hpp>"], ["installed headers"]),
    ("proto/include/lightwell/e.hpp", ["<unistd.h>"],
     ["installed headers", "POSIX and Windows in one folder"]),
    ("proto/include/lightwell/f.hpp", ["<google/protobuf/message.h>"],
     ["installed headers", "protobuf is private"]),
    ("proto/include/lightwell/g.hpp", ['"lightwell/v1/descriptor.pb.h"'],
     ["installed headers", "generated messages"]),
    ("proto/src/a.cpp", ["<Eigen/Core>"], ["proto uses the standard library"]),
    ("proto/src/key.cpp", ["<openssl/evp.h>"], ["OpenSSL where keys", "proto uses the standard library"]),
    ("proto/src/pairing/a.cpp", ["<google/protobuf/message.h>"], ["the computations of both ends of a pairing"]),
    ("proto/src/mqtt_session.cpp", ["<openssl/ssl.h>"], ["OpenSSL where keys", "the MQTT session"]),
    ("firmware/link/grpc/key.cpp", ["<openssl/evp.h>"], ["OpenSSL where keys"]),
    ("host_sdk/src/core/grpc_key.cpp", ["<openssl/ssl.h>"], ["OpenSSL where keys"]),
    ("proto/src/b.cpp", ['"pose/tag.hpp"'], ["proto depends on nothing"]),
    ("proto/src/d.cpp", ["<lightwell/config.hpp>"], ["proto depends on nothing"]),
    ("proto/include/lightwell/h.hpp", ["<lightwell/config.hpp>"], ["proto depends on nothing"]),
    ("proto/firmware/include/lightwell/a.hpp", ['"wire.hpp"'], ["the firmware part of proto -> what the SDK installs"]),
    ("proto/firmware/include/lightwell/b.hpp", ["<Eigen/Core>"], ["values of the firmware"]),
    ("proto/firmware/src/a.cpp", ['"pose/tag.hpp"'], ["the firmware part of proto -> proto"]),
    ("proto/firmware/src/b.cpp", ["<Eigen/Core>"], ["the firmware part of proto uses the standard library"]),
    ("proto/src/c.cpp", ['"lightwell/v1/service.grpc.pb.h"'], ["generated services"]),
    ("firmware/imaging/a.cpp", ['"camera/backends/v4l2/v4l2.hpp"'], ["imaging -> proto"]),
    ("firmware/imaging/b.cpp", ["<lightwell/config.hpp>"], ["imaging -> proto"]),
    ("firmware/camera/a.cpp", ['"calibration/model/camera_model.hpp"'], ["camera -> imaging"]),
    ("firmware/camera/b.cpp", ['"camera/backends/v4l2/v4l2.hpp"'], ["camera -> imaging"]),
    ("firmware/camera/c.cpp", ["<linux/videodev2.h>"], ["V4L2 in its backend"]),
    ("firmware/camera/d.hpp", ["<opencv2/core.hpp>"], ["OpenCV in .cpp files only"]),
    ("firmware/link/ffs.cpp", ["<linux/usb/functionfs.h>"], ["FunctionFS in the gadget"]),
    ("firmware/camera/e.cpp", ["<libusb-1.0/libusb.h>"], ["libusb in the host"]),
    ("firmware/camera/f.cpp", ['"../../host_sdk/src/core/store.hpp"'], ["camera -> imaging"]),
    ("firmware/camera/g.cpp", ['"camera/missing.hpp"', '"link/missing.hpp"'], ["camera -> imaging"]),
    ("firmware/camera/backends/sim/a.cpp", ['"pose/tag.hpp"'], ["backends/sim ->"]),
    ("firmware/camera/backends/sim/b.cpp", ['"camera/backends/v4l2/v4l2.hpp"'], ["backends/sim ->"]),
    ("firmware/camera/backends/v4l2/a.cpp", ['"../sim/sim.hpp"'], ["backends are peers"]),
    ("firmware/camera/backends/v4l2/b.cpp", ['"sim/scene.hpp"'], ["backends are peers"]),
    ("firmware/camera/backends/v4l2/c.cpp", ['"calibration/model/camera_model.hpp"'], ["backends are peers"]),
    ("firmware/camera/backends/v4l2/d.cpp", ["<libcamera/camera.h>"], ["libcamera in its backend"]),
    ("firmware/camera/backends/v4l2/e.cpp", ["<depthai/depthai.hpp>"], ["depthai in its backend"]),
    ("firmware/calibration/model/a.cpp", ['"calibration/solve/bundle.hpp"'], ["calibration/model -> imaging"]),
    ("firmware/calibration/model/b.cpp", ["<ceres/ceres.h>"], ["Ceres in .cpp files"]),
    ("firmware/calibration/solve/a.cpp", ['"pose/tag.hpp"'], ["calibration/solve -> imaging"]),
    ("firmware/calibration/solve/b.hpp", ["<ceres/ceres.h>"], ["Ceres in .cpp files"]),
    ("firmware/calibration/solve/c.cpp", ["<apriltag/apriltag.h>"], ["AprilTag in pose"]),
    ("firmware/calibration/solve/d.cpp", ["<yaml-cpp/yaml.h>"], ["YAML of other programs"]),
    ("firmware/sim/a.cpp", ['"estimate/common/lights.hpp"'], ["sim -> imaging"]),
    ("firmware/pose/a.cpp", ['"sim/scene.hpp"'], ["pose -> imaging"]),
    ("firmware/pose/b.cpp", ['"estimate/common/lights.hpp"'], ["pose -> imaging"]),
    ("firmware/estimate/a.cpp", ['"pose/tag.hpp"'], ["estimate -> imaging"]),
    ("firmware/estimate/b.cpp", ['"sim/scene.hpp"'], ["estimate -> imaging"]),
    ("firmware/estimate/c.cpp", ['"link/link.hpp"'], ["estimate -> imaging"]),
    ("firmware/estimate/common/a.cpp", ['"imaging/frame.hpp"'], ["estimate/common knows light"]),
    ("firmware/estimate/common/b.cpp", ['"calibration/model/camera_model.hpp"'], ["estimate/common knows light"]),
    ("firmware/estimate/common/c.cpp", ['"estimate/frames/rows.hpp"'], ["estimate/common knows light"]),
    ("firmware/estimate/frames/a.cpp", ['"estimate/panorama/blocks.hpp"'], ["estimate/frames -> imaging"]),
    ("firmware/estimate/panorama/a.cpp", ["<ceres/ceres.h>"], ["Ceres in .cpp files"]),
    ("firmware/link/a.cpp", ['"imaging/frame.hpp"'], ["link -> proto"]),
    ("firmware/link/b.cpp", ["<grpcpp/grpcpp.h>"], ["gRPC in the two network links"]),
    ("firmware/link/c.cpp", ["<grpc/grpc.h>"], ["gRPC in the two network links"]),
    ("proto/src/files.cpp", ["<unistd.h>"],
     ["proto uses the standard library", "POSIX and Windows in one folder"]),
    ("proto/src/platform/a_posix.cpp", ["<windows.h>"], ["POSIX in the files of one folder"]),
    ("proto/src/platform/a_windows.cpp", ["<unistd.h>"], ["Windows in the files of one folder"]),
    ("proto/src/platform/a.cpp", ["<unistd.h>"], ["POSIX and Windows in files of their own"]),
    ("proto/src/platform/sockets.hpp", ["<unistd.h>"], ["what POSIX and Winsock write alike"]),
    ("proto/src/platform/b_posix.cpp", ['"wire.hpp"'], ["what differs between systems"]),
    ("host_sdk/src/core/posix.cpp", ["<netdb.h>"], ["POSIX and Windows in one folder"]),
    ("host_sdk/src/core/windows.cpp", ["<windows.h>"], ["POSIX and Windows in one folder"]),
    ("host_sdk/src/c/posix.cpp", ["<sys/stat.h>"], ["POSIX and Windows in one folder"]),
    ("firmware/link/mqtt/w.cpp", ["<libwebsockets.h>"], ["libwebsockets in the two ends"]),
    ("firmware/link/mqtt/d.cpp", ["<mosquitto.h>"], ["libmosquitto in the one session"]),
    ("host_sdk/src/core/mqtt_e.cpp", ["<mqtt_protocol.h>"], ["libmosquitto in the one session"]),
    ("firmware/link/f.cpp", ["<avahi-common/error.h>"], ["Avahi in the two ends"]),
    ("firmware/link/mqtt/a.cpp", ['"lightwell/v1/service.grpc.pb.h"'], ["generated services"]),
    ("firmware/link/grpc/a.cpp", ['"lightwell/v1/descriptor.pb.h"'], ["generated messages"]),
    ("firmware/app/a.cpp", ["<lightwell/probe.hpp>"], ["app uses all", "firmware and proto do not depend"]),
    ("firmware/app/b.cpp", ["<lightwell/lightwell.h>"], ["app uses all"]),
    ("firmware/app/c.cpp", ['"wire.hpp"'], ["app uses all"]),
    ("firmware/app/d.cpp", ['"support/image.hpp"'], ["app uses all"]),
    ("firmware/app/e.cpp", ["<google/protobuf/text_format.h>"], ["protobuf is private"]),
    ("firmware/app/f.cpp", ["<nlohmann/json.hpp>"], ["nlohmann-json in tools"]),
    ("firmware/tools/a.cpp", ['"core/store.hpp"'], ["tools use all"]),
    ("firmware/tools/b.cpp", ["<apriltag/apriltag.h>"], ["AprilTag in pose"]),
    ("firmware/tools/c.cpp", ["<embree3/rtcore.h>"], ["Embree"]),
    ("firmware/novel/a.cpp", ["<vector>"], ["a module needs a line"]),
    ("host_sdk/include/lightwell/a.hpp", ['"core/store.hpp"'], ["the SDK's headers"]),
    ("host_sdk/include/lightwell/d.hpp", ["<lightwell/config.hpp>"], ["without its firmware part"]),
    ("host_sdk/include/lightwell/b.hpp", ["<glm/vec3.hpp>"], ["installed headers"]),
    ("host_sdk/include/lightwell/c.hpp", ["<grpcpp/grpcpp.h>"],
     ["installed headers", "gRPC in the two network links"]),
    ("host_sdk/include/lightwell/glm.hpp", ["<glm/vec3.hpp>", "<Eigen/Core>"], ["GLM is opt-in"]),
    ("host_sdk/src/c/a.cpp", ['"core/store.hpp"'], ["the C ABI -> the SDK's headers"]),
    ("host_sdk/src/core/a.cpp", ['"field/fit.hpp"'], ["core -> the SDK's headers"]),
    ("host_sdk/src/core/b.cpp", ['"imaging/frame.hpp"'], ["core -> the SDK's headers"]),
    ("host_sdk/src/core/c.cpp", ["<opencv2/core.hpp>"], ["no OpenCV in proto and in the SDK's core"]),
    ("host_sdk/src/core/d.cpp", ["<ceres/ceres.h>"], ["Ceres in .cpp files"]),
    ("host_sdk/src/core/e.cpp", ["<embree3/rtcore.h>"], ["Embree"]),
    ("host_sdk/src/core/draw.cpp", ["<epoxy/gl.h>"], ["OpenGL in the viewer"]),
    ("host_sdk/src/core/draw_window.cpp", ["<GLFW/glfw3.h>"], ["windows in the viewer"]),
    ("host_sdk/tools/lightwell/panel.cpp", ["<imgui.h>"], ["the viewer's panel"]),
    ("host_sdk/tools/ar_viewer/mesh.cpp", ["<tiny_gltf.h>"], ["glTF in the viewer's loader"]),
    ("host_sdk/tools/ar_viewer/frame.cpp", ["<OpenEXR/ImfHeader.h>"], ["OpenEXR where pictures"]),
    ("host_sdk/src/core/headset.cpp", ["<openxr/openxr.h>"], ["OpenXR in its layer and its sample"]),
    ("host_sdk/openxr_layer/a.cpp", ['"core/store.hpp"'], ["the OpenXR layer -> the SDK's headers"]),
    ("host_sdk/src/core/f.cpp", ["<grpcpp/grpcpp.h>"], ["gRPC in the two network links"]),
    ("host_sdk/src/core/g.cpp", ["<nlohmann/json_fwd.hpp>"], ["nlohmann-json in tools"]),
    ("host_sdk/src/core/h.cpp", ["<lightwell/config.hpp>"], ["without its firmware part"]),
    ("host_sdk/src/c/b.cpp", ["<lightwell/config.hpp>"], ["the C ABI -> the SDK's headers"]),
    ("host_sdk/tools/c.cpp", ["<lightwell/config.hpp>"], ["host_sdk and firmware never"]),
    ("host_sdk/src/core/link_grpc_a.cpp", ["<libusb-1.0/libusb.h>"], ["libusb in the host"]),
    ("host_sdk/src/field/a.cpp", ['"relight/trace.hpp"'], ["field -> core"]),
    ("host_sdk/src/field/b.cpp", ["<embree3/rtcore.h>"], ["Embree in src/rays"]),
    ("host_sdk/src/rays/a.cpp", ['"core/store.hpp"'], ["rays -> proto"]),
    ("host_sdk/src/image_object/view.hpp", ['"relight/trace.hpp"'], ["image_object -> core"]),
    ("host_sdk/src/relight/trace.hpp", ['"field/fit.hpp"'], ["relight -> core"]),
    ("host_sdk/tools/a.cpp", ['"sim/scene.hpp"'], ["host_sdk and firmware never"]),
    ("tests/proto/a_test.cpp", ['"imaging/frame.hpp"'], ["tests of proto"]),
    ("tests/firmware/a_test.cpp", ["<lightwell/probe.hpp>"], ["firmware and host_sdk meet"]),
    ("tests/host_sdk/a_test.cpp", ['"sim/scene.hpp"'], ["firmware and host_sdk meet"]),
    ("tests/reference/a.cpp", ["<lightwell/sh.hpp>"], ["a reference implementation shares no code"]),
    ("tests/reference/marker/a.cpp", ['"pose/tag.hpp"', '"estimate/common/lights.hpp"'], ["the renderer of markers"]),
    ("tests/bench/a.cpp", ['"sim/scene.hpp"', "<lightwell/probe.hpp>"], ["firmware and host_sdk meet"]),
    ("tests/support/a.hpp", ["<opencv2/core.hpp>"], ["OpenCV in .cpp files only"]),
    ("hil/a.hpp", ["<opencv2/core.hpp>"], ["OpenCV in .cpp files only"]),
]

# Modules whose line in [arrows] allows everything, so that no file can break it.
OPEN_MODULES = ("tests", "hil")


def write(root, path, names, preamble=""):
    file = root / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(preamble + "".join(f"#include {name}\n" for name in names))
    return preamble.count("\n") + len(names)


def self_test(root, rules):
    """Returns 0 if the clean tree passes and exactly the broken rules are reported, else 1."""
    failures = []
    for path, names in CLEAN.items():
        write(root, path, names, NO_INCLUDES)
    clean = Checker(root, rules)
    for finding in clean.check():
        failures.append(f"clean tree: {finding.file}:{finding.line} {finding.arrow}: {finding.rule.why}")
    if clean.files != len(CLEAN):
        failures.append(f"clean tree: {clean.files} files were read, expected {len(CLEAN)}")

    lines = {path: write(root, path, names) for path, names, _ in BROKEN}
    findings = Checker(root, rules).check()
    for path, _, expected in BROKEN:
        found = [finding for finding in findings if finding.file == path]
        texts = sorted(finding.rule.why for finding in found)
        unseen = [words for words in expected if not any(words in text for text in texts)]
        if unseen or len(found) != len(expected):
            failures.append(f"{path}: expected {expected}, reported {texts}")
        if any(finding.line != lines[path] for finding in found):
            failures.append(f"{path}: reported on another line than {lines[path]}")
    for finding in findings:
        if finding.file not in lines:
            failures.append(f"{finding.file}: reported, but it breaks no rule")

    broken = {finding.rule.line for finding in findings}
    for rule in rules:
        if rule.line not in broken and not (rule.section == "arrows" and rule.left[0] in OPEN_MODULES):
            failures.append(f"arrows.txt:{rule.line}: no case breaks this rule")

    for failure in failures:
        print(failure)
    print(f"self-test: {len(CLEAN)} clean files, {len(BROKEN)} broken ones, {len(failures)} failures")
    return 1 if failures else 0
