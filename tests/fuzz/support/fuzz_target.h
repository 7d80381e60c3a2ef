// What a fuzzer is made of. Each target defines kTarget; the rest is the same for all: with
// libFuzzer (preset fuzz) it searches, without it replays (replay_main.cc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string_view>
#include <vector>

#include "core/base/bytes.h"

namespace atlas::fuzz {

using Random = std::minstd_rand;

struct Target {
  // Inputs that are taken, by the project's own encoders: where the search begins.
  std::vector<Bytes> (*seeds)() = nullptr;
  // Whether the input was taken. Ends the program where a promise is broken.
  bool (*run)(ByteSpan input) = nullptr;
  // Another input near this one, of at most `max_size` bytes: behind checksums and compression,
  // which hold again.
  Bytes (*mutate)(ByteSpan input, std::size_t max_size, Random& random) = nullptr;
};
extern const Target kTarget;

// Changes bytes as libFuzzer does, or as the replay's stand-in: what every mutation comes down to.
Bytes Garbled(ByteSpan bytes, std::size_t max_size);
// `mutate` of formats that need nothing else.
Bytes MutatePlain(ByteSpan input, std::size_t max_size, Random& random);

// Once in `n`.
inline bool OneIn(std::uint32_t n, Random& random) {
  return random() % n == 0;
}

// A promise of the code under test; prints it and aborts where it does not hold.
void Require(bool holds, const char* promise);

inline Bytes BytesOf(std::string_view text) {
  return {text.begin(), text.end()};
}
inline std::string_view TextOf(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace atlas::fuzz
