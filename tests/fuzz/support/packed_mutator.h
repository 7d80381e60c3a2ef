// Mutation of what lies behind a checksum or compression.
#pragma once

#include <optional>

#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {

// A format with a flat form: all that is in it, in the clear.
struct Packing {
  // nullopt: the input is none of the format.
  std::optional<Bytes> (*unpack)(ByteSpan input) = nullptr;
  // Of whatever bytes: what is missing is 0.
  Bytes (*pack)(ByteSpan flat) = nullptr;
  // Puts the checksums right that are in the clear; null: there are none.
  void (*seal)(Bytes& input) = nullptr;
};

// Most times the flat form is changed; now and then the bytes themselves with their checksums put
// right, so that sizes lie; and now and then only the bytes.
Bytes MutatePacked(ByteSpan input, std::size_t max_size, Random& random, const Packing& packing);

// The last 8 bytes become the Hash64 of those before them.
void SealAtEnd(Bytes& input);

}  // namespace atlas::fuzz
