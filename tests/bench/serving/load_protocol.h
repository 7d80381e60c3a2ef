// What a load generator says and hears, of the daemon's protocol and of HTTP: batches of requests
// for tiles as bytes, and how far the replies have come. It looks at what it must to know where a
// reply ends, and at nothing else, in both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "core/base/bytes.h"

namespace atlas::testing {

struct LoadTile {
  std::uint64_t key = 0;
  std::uint64_t payload_hash = 0;
  std::string path;  // of its file, after the server's root
  std::string etag;  // that the server gives it
};

enum class LoadMode {
  kFetch,        // tiles of which nothing is held
  kNotModified,  // tiles that are held as they are
};

// Bytes of replies in, as they come.
class ReplyParser {
 public:
  ReplyParser() = default;
  ReplyParser(const ReplyParser&) = delete;
  ReplyParser& operator=(const ReplyParser&) = delete;
  virtual ~ReplyParser() = default;

  // All of them are taken. False: that is no reply to what was asked.
  virtual bool Take(ByteSpan bytes) = 0;
  // Since the last call.
  std::uint64_t TakeTiles() { return std::exchange(tiles_, 0); }
  // Requests whose reply has come whole, since the last call.
  std::uint64_t TakeReplies() { return std::exchange(replies_, 0); }
  std::uint64_t tile_bytes() const { return tile_bytes_; }

 protected:
  std::uint64_t tiles_ = 0;
  std::uint64_t replies_ = 0;
  std::uint64_t tile_bytes_ = 0;
};

class LoadProtocol {
 public:
  LoadProtocol() = default;
  LoadProtocol(const LoadProtocol&) = delete;
  LoadProtocol& operator=(const LoadProtocol&) = delete;
  virtual ~LoadProtocol() = default;

  // To be sent first; its reply counts as one.
  virtual Bytes Greeting() const = 0;
  // Requests for these tiles, all at once, and how many replies end them.
  virtual std::size_t Ask(std::span<const LoadTile* const> tiles, LoadMode mode, Bytes& out) = 0;
  virtual std::unique_ptr<ReplyParser> NewParser() const = 0;
};

std::unique_ptr<LoadProtocol> MakeAtlasProtocol();
std::unique_ptr<LoadProtocol> MakeHttpProtocol();

}  // namespace atlas::testing
