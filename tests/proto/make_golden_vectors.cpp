// make_golden_vectors DIRECTORY: writes the golden messages, binary and JSON.
#include <filesystem>
#include <fstream>
#include <iostream>

#include <lightwell/codec.hpp>
#include <lightwell/plane_codec.hpp>

#include "golden_vectors.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_golden_vectors DIRECTORY\n";
    return 2;
  }
  lightwell::Encoder encoder;
  for (const lightwell::GoldenVector& v : lightwell::golden_vectors()) {
    const auto bytes = encoder.encode(v.descriptor);
    const auto json = bytes ? lightwell::descriptor_to_json(*bytes) : lightwell::Result<std::string>(bytes.status());
    if (!json) {
      std::cerr << v.name << ": " << json.status().message() << "\n";
      return 1;
    }
    const std::string stem = std::string(argv[1]) + "/" + v.name;
    std::ofstream(stem + ".bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
    std::ofstream(stem + ".json") << *json << "\n";
  }
  lightwell::PlaneEncoder planes({.images = lightwell::ImageRecipients::all_clients});
  const auto messages = planes.encode(lightwell::golden_plane(), {});
  if (!messages) {
    std::cerr << messages.status().message() << "\n";
    return 1;
  }
  const std::filesystem::path folder = std::filesystem::path(argv[1]) / "captured_plane";
  std::filesystem::create_directories(folder);
  const std::vector<std::byte>& bytes = messages->front();
  std::ofstream(folder / "v1_small.bin", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return 0;
}
