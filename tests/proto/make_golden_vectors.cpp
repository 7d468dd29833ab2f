// make_golden_vectors DIRECTORY: writes the golden messages, binary and JSON.
#include <fstream>
#include <iostream>

#include <lightwell/codec.hpp>

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
  return 0;
}
