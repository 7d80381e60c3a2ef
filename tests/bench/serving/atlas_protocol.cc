#include <algorithm>

#include "proto/wire/envelope.h"
#include "tests/bench/serving/load_frames.h"
#include "tests/bench/serving/load_protocol.h"

namespace atlas::testing {
namespace {

// Enough of a frame to see what it is: header, request_id, the body's tag.
constexpr std::size_t kLookBytes = kFrameHeaderBytes + 16;

class AtlasParser final : public ReplyParser {
 public:
  bool Take(ByteSpan bytes) override {
    while (!bytes.empty()) {
      if (skip_bytes_ > 0) {
        const std::size_t size = std::min(skip_bytes_, bytes.size());
        skip_bytes_ -= size;
        bytes = bytes.subspan(size);
        continue;
      }
      const std::size_t wanted = WantedBytes() - head_.size();
      const std::size_t size = std::min(wanted, bytes.size());
      head_.insert(head_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      bytes = bytes.subspan(size);
      if (head_.size() == WantedBytes() && !Look()) {
        return false;
      }
    }
    return true;
  }

 private:
  std::size_t WantedBytes() const {
    return head_.size() < kFrameHeaderBytes
               ? kFrameHeaderBytes
               : std::min(kLookBytes, kFrameHeaderBytes + payload_bytes_);
  }

  bool Look() {
    if (payload_bytes_ == 0) {
      const auto header =
          DecodeFrameHeader(ByteSpan(head_).first(kFrameHeaderBytes), kMaxFrameBytes);
      if (!header) {
        return false;
      }
      payload_bytes_ = header->payload_bytes;
      return payload_bytes_ > 0;
    }
    ByteReader in(ByteSpan(head_).subspan(kFrameHeaderBytes));
    std::uint64_t field = in.Varint() >> 3;
    if (field == wire::Envelope::kRequestIdFieldNumber) {
      in.Varint();
      field = in.Varint() >> 3;
    }
    if (field == wire::Envelope::kTileFieldNumber) {
      ++tiles_;
      tile_bytes_ += payload_bytes_;
    } else if (field == wire::Envelope::kSyncEndFieldNumber ||
               field == wire::Envelope::kHelloReplyFieldNumber) {
      ++replies_;
    } else if (field != wire::Envelope::kSyncManifestFieldNumber) {
      return false;
    }
    skip_bytes_ = kFrameHeaderBytes + payload_bytes_ - head_.size();
    head_.clear();
    payload_bytes_ = 0;
    return true;
  }

  Bytes head_;
  std::size_t payload_bytes_ = 0;
  std::size_t skip_bytes_ = 0;
};

class AtlasProtocol final : public LoadProtocol {
 public:
  Bytes Greeting() const override { return HelloFrame(); }

  std::size_t Ask(std::span<const LoadTile* const> tiles, LoadMode mode, Bytes& out) override {
    wire::Envelope envelope;
    envelope.set_request_id(++last_id_);
    wire::SyncRequest& sync = *envelope.mutable_sync_request();
    std::vector<const LoadTile*> sorted(tiles.begin(), tiles.end());
    std::sort(sorted.begin(), sorted.end(),
              [](const LoadTile* a, const LoadTile* b) { return a->key < b->key; });
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    wire::Held* const held = mode == LoadMode::kNotModified ? sync.add_held() : nullptr;
    for (const LoadTile* tile : sorted) {
      sync.mutable_area()->mutable_tiles()->add_keys(tile->key);
      if (held != nullptr) {
        held->add_keys(tile->key);
        held->add_payload_hashes(tile->payload_hash);
      }
    }
    const Bytes frame = EncodeEnvelopeFrame(envelope).value();
    out.insert(out.end(), frame.begin(), frame.end());
    return 1;
  }

  std::unique_ptr<ReplyParser> NewParser() const override {
    return std::make_unique<AtlasParser>();
  }

 private:
  std::uint64_t last_id_ = 1;
};

}  // namespace

std::unique_ptr<LoadProtocol> MakeAtlasProtocol() {
  return std::make_unique<AtlasProtocol>();
}

}  // namespace atlas::testing
