// Replaces grpc_source.cpp and grpc_pairing.cpp in an SDK without gRPC.
#include <lightwell/pair.hpp>

#include "core/source.hpp"

namespace lightwell {
namespace {

constexpr std::string_view kBuiltWithoutGrpc =
    "this SDK was built without gRPC: install libgrpc++-dev and configure it again with LIGHTWELL_WITH_GRPC=ON";

}  // namespace

Result<std::unique_ptr<core::Source>> core::make_grpc_source(const GrpcAddress&, ProbeOptions, DescriptorReceiver&) {
  return Status(StatusCode::failed_precondition,
                std::string(kBuiltWithoutGrpc) + ", or reach the probe at usb: or mqtt://BROKER/TOPIC");
}

Result<PairedProbe> pair_with_probe(std::string_view uri, std::string_view, const PairOptions&) {
  return Status(StatusCode::failed_precondition, std::string(uri) + ": " + std::string(kBuiltWithoutGrpc));
}

}  // namespace lightwell
