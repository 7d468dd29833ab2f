#include <cstdio>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/recording.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

void print_text(double seconds, std::size_t bytes, const Descriptor& descriptor) {
  const Lighting lighting = Lighting::of(descriptor);
  const double up = static_cast<double>(lighting.irradiance({0, 1, 0}).value.luminance());
  std::printf(
      "#%llu  %8.3f s  %zu B  band %d  lights %zu  upward irradiance %.4g%s  bound %s  "
      "flags %s\n",
      static_cast<unsigned long long>(descriptor.sequence), seconds, bytes, descriptor.radiance.band,
      descriptor.lights.size(), up, descriptor.units == Units::absolute ? " lux" : "",
      bound_text(descriptor.bound.total).c_str(), flags_text(descriptor.flags).c_str());
}

}  // namespace

int run_replay(const Options& options) {
  RecordReader reader = require(RecordReader::open(options.file), kFile);
  if (reader.header().kind != RecordingKind::descriptors)
    fail(kFile,
         options.file + " holds a camera's frames, not descriptors; lightwelld plays it as the camera replay:PATH");
  std::size_t count = 0, bad = 0;
  std::optional<std::int64_t> first_ns;
  Record record;
  while (reader.next(record)) {
    ++count;
    if (!first_ns) first_ns = record.time_ns;
    const Result<Descriptor> descriptor = decode_descriptor(record.payload);
    if (!descriptor.ok()) {
      ++bad;
      warn("record " + std::to_string(count) + ": " + descriptor.status().message());
      continue;
    }
    const double seconds = Duration{record.time_ns - *first_ns}.seconds();
    if (!options.json) {
      print_text(seconds, record.payload.size(), *descriptor);
      continue;
    }
    const std::string json = require(descriptor_to_json(record.payload), kFile);
    print_json(
        {{"seconds", seconds}, {"bytes", record.payload.size()}, {"descriptor", nlohmann::ordered_json::parse(json)}});
  }
  if (reader.torn_bytes() > 0)
    warn(options.file + " is truncated: its last " + std::to_string(reader.torn_bytes()) +
         " bytes are not a complete record");
  if (count == 0) fail(kNothingReceived, options.file + " contains no descriptor");
  return bad > 0 ? kFile : kOk;
}

}  // namespace lightwell::tool
