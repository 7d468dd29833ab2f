// Does a known number of instructions ROUNDS times on each of THREADS threads: `known_count ROUNDS THREADS`.
#include <cstdint>
#include <cstdlib>
#include <thread>
#include <vector>

namespace {

// A round is 1 + 1000 * 3 + 2 instructions; the assembler leaves no room for the compiler's opinion.
void work(std::uint64_t rounds) {
  asm volatile(
      "1: mov x1, #1000\n"
      "2: add v0.4s, v0.4s, v0.4s\n"
      "   subs x1, x1, #1\n"
      "   b.ne 2b\n"
      "   subs %0, %0, #1\n"
      "   b.ne 1b\n"
      : "+r"(rounds)
      :
      : "x1", "v0", "cc");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::uint64_t rounds = std::strtoull(argv[1], nullptr, 10);
  const int threads = std::atoi(argv[2]);
  if (rounds == 0) return 2;
  if (threads == 1) {
    work(rounds);
    return 0;
  }
  std::vector<std::thread> running;
  for (int k = 0; k < threads; ++k) running.emplace_back(work, rounds);
  for (std::thread& t : running) t.join();
}
