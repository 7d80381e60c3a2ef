// Frames as bytes come: however they are cut, the same payloads and the same end, and large ones
// taken aside are those that stood there.
#include <algorithm>

#include "core/base/hash.h"
#include "proto/wire/frame.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/frame_packing.h"
#include "tests/fuzz/support/request_seeds.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kLargeBytes = 256;
constexpr std::uint32_t kMaxPayloadBytes = 16u << 10;

struct Decoded {
  std::vector<Bytes> payloads;
  Status end;

  friend bool operator==(const Decoded&, const Decoded&) = default;
};

std::vector<Bytes> Seeds() {
  const auto requests = RequestSeeds(testing::GoldenProfile());
  return {FramesOf({requests.back(), HelloSeed(testing::GoldenProfile())}),
          FramesOf({requests[1]})};
}

// False when the decoder wants no more.
bool TakeAll(FrameDecoder& decoder, bool takes_large, Decoded& decoded) {
  while (true) {
    if (const auto large = takes_large ? decoder.TakeLarge(kLargeBytes) : std::nullopt) {
      const auto payload = large->Payload();
      if (!payload) {
        decoded.end = payload.error();
        return false;
      }
      decoded.payloads.emplace_back(payload->begin(), payload->end());
      continue;
    }
    const auto payload = decoder.Next();
    if (!payload) {
      decoded.end = payload.error();
      return false;
    }
    if (!*payload) {
      return true;
    }
    decoded.payloads.emplace_back((*payload)->begin(), (*payload)->end());
  }
}

Decoded Decode(ByteSpan stream, std::size_t step, bool takes_large) {
  FrameDecoder decoder(kMaxPayloadBytes);
  Decoded decoded;
  while (!stream.empty()) {
    const ByteSpan piece = stream.first(std::min(step, stream.size()));
    stream = stream.subspan(piece.size());
    decoder.Push(piece);
    Require(decoder.pending_bytes() <= kFrameHeaderBytes + kMaxPayloadBytes + step,
            "no more is kept than a frame");
    if (!TakeAll(decoder, takes_large, decoded)) {
      break;
    }
  }
  return decoded;
}

bool Run(ByteSpan stream) {
  const Decoded whole = Decode(stream, stream.size(), false);
  const std::size_t step = 1 + Hash64(stream) % 97;
  Require(Decode(stream, step, false) == whole, "pieces make the same frames");
  Require(Decode(stream, step, true).payloads == whole.payloads,
          "large frames are the same frames");
  return whole.end.ok() && !whole.payloads.empty();
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return OneIn(2, random) ? Garbled(input, max_size)
                          : MutateFrames(input, max_size, random, nullptr);
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
