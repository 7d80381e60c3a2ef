#include <algorithm>
#include <charconv>
#include <string_view>

#include "core/base/str_cat.h"
#include "tests/bench/serving/load_protocol.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kMaxHeadBytes = 16u << 10;

class HttpParser final : public ReplyParser {
 public:
  bool Take(ByteSpan bytes) override {
    while (!bytes.empty()) {
      if (skip_bytes_ > 0) {
        const std::size_t size = std::min(skip_bytes_, bytes.size());
        skip_bytes_ -= size;
        bytes = bytes.subspan(size);
        replies_ += skip_bytes_ == 0 ? 1 : 0;
        continue;
      }
      // A head is whole at its empty line, which may come in two pieces.
      const std::size_t before = head_.size();
      const std::size_t size = std::min<std::size_t>(bytes.size(), 1'024);
      head_.append(reinterpret_cast<const char*>(bytes.data()), size);
      const std::size_t end = head_.find("\r\n\r\n", before < 3 ? 0 : before - 3);
      if (end == std::string::npos) {
        bytes = bytes.subspan(size);
        if (head_.size() > kMaxHeadBytes) {
          return false;
        }
        continue;
      }
      bytes = bytes.subspan(end + 4 - before);
      head_.resize(end + 4);
      if (!Look()) {
        return false;
      }
      head_.clear();
    }
    return true;
  }

 private:
  bool Look() {
    const std::string_view head = head_;
    if (head.starts_with("HTTP/1.1 304")) {
      ++replies_;
      return true;
    }
    constexpr std::string_view kLength = "\r\nContent-Length: ";
    const std::size_t at = head.find(kLength);
    if (!head.starts_with("HTTP/1.1 200") || at == std::string_view::npos) {
      return false;
    }
    const char* const digits = head.data() + at + kLength.size();
    if (std::from_chars(digits, head.data() + head.size(), skip_bytes_).ec != std::errc()) {
      return false;
    }
    ++tiles_;
    tile_bytes_ += skip_bytes_;
    replies_ += skip_bytes_ == 0 ? 1 : 0;
    return true;
  }

  std::string head_;
  std::size_t skip_bytes_ = 0;
};

class HttpProtocol final : public LoadProtocol {
 public:
  Bytes Greeting() const override { return {}; }

  std::size_t Ask(std::span<const LoadTile* const> tiles, LoadMode mode, Bytes& out) override {
    for (const LoadTile* tile : tiles) {
      Append("GET /", out);
      Append(tile->path, out);
      Append(" HTTP/1.1\r\nHost: tiles\r\n", out);
      if (mode == LoadMode::kNotModified) {
        Append("If-None-Match: ", out);
        Append(tile->etag, out);
        Append("\r\n", out);
      }
      Append("\r\n", out);
    }
    return tiles.size();
  }

  std::unique_ptr<ReplyParser> NewParser() const override { return std::make_unique<HttpParser>(); }

 private:
  static void Append(std::string_view text, Bytes& out) {
    out.insert(out.end(), text.begin(), text.end());
  }
};

}  // namespace

std::unique_ptr<LoadProtocol> MakeHttpProtocol() {
  return std::make_unique<HttpProtocol>();
}

}  // namespace atlas::testing
