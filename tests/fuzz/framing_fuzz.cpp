// A FrameReader on any bytes in any pieces, with intact frames among them: those arrive, and what else arrives has held
// its checksums. What is a request is answered, or is none.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include <lightwell/commands.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "support/fake_commands.hpp"

namespace {

using namespace lightwell;

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span rest = std::as_bytes(std::span(data, size));
  FrameReader reader;
  FrameWriter writer(0x5EED);
  test::FakeCommands commands;
  std::vector<std::byte> frame, response;
  std::uint64_t pushed = 0, whole = 0, intact = 0, seen = 0;
  const FrameReader::FrameCallback take = [&](const LinkFrame& f) {
    whole += kFrameHeaderBytes + f.payload.size();
    if (f.session == 0x5EED && f.payload.size() == 3) ++seen;
    if (f.kind == FrameKind::request && answer_link_request(f.payload, commands, response).ok())
      require(decode_link_response(response).ok());
  };
  while (!rest.empty()) {
    const auto order = std::to_integer<unsigned>(rest.front());
    rest = rest.subspan(1);
    const std::size_t piece = std::min<std::size_t>(rest.size(), order >> 2U);
    reader.push(rest.first(piece), take);
    pushed += piece;
    rest = rest.subspan(piece);
    if ((order & 1U) != 0) reader.end_transfer(take);
    if ((order & 2U) != 0) reader.begin_stream();
    if ((order & 3U) == 0) continue;
    // Who forges a frame whole is another writer; ours would then be one whose session is over.
    if (reader.session() && reader.session() != writer.session()) return 0;
    // Behind an end, whatever came before, an intact frame arrives at once.
    const std::byte known[3] = {std::byte{1}, std::byte{2}, std::byte{3}};
    require(writer.write(FrameKind::response, known, frame).ok());
    reader.push(frame, take);
    pushed += frame.size();
    ++intact;
    require(seen == intact);
  }
  reader.end_transfer(take);
  const FrameCounters& c = reader.counters();
  require(seen == intact);
  require(whole + c.skipped_bytes <= pushed);
  return 0;
}
