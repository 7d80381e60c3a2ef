#include "core/base/compression.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <memory>
#include <utility>

#include <zstd.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr int kMaxWindowLog = 27;  // what every decompressor takes

using Compressor = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;
using Decompressor = std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)>;

Compressor MakeCompressor(int level) {
  Compressor context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  return context;
}

Bytes CompressWith(ZSTD_CCtx* context, ByteSpan bytes) {
  Bytes frame(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context, frame.data(), frame.size(), bytes.data(), bytes.size());
  assert(ZSTD_isError(size) == 0);  // the buffer is ZSTD_compressBound bytes long
  frame.resize(size);
  return frame;
}

// Both in one window, so that all of the prefix can be referred to.
int WindowLog(std::size_t bytes) {
  const ZSTD_bounds bounds = ZSTD_cParam_getBounds(ZSTD_c_windowLog);
  return std::clamp(static_cast<int>(std::bit_width(bytes)), bounds.lowerBound, kMaxWindowLog);
}

Status CheckFrame(ByteSpan frame, std::size_t expected_size) {
  if (ZSTD_getFrameContentSize(frame.data(), frame.size()) != expected_size) {
    return {StatusCode::kInvalidData,
            StrCat("compressed block does not declare the expected ", expected_size, " bytes")};
  }
  if (ZSTD_findFrameCompressedSize(frame.data(), frame.size()) != frame.size()) {
    return {StatusCode::kInvalidData, "compressed block is truncated or has trailing bytes"};
  }
  return {};
}

Status Unpack(ByteSpan prefix, ByteSpan frame, std::span<std::uint8_t> content) {
  // One a thread: to be made for each frame it is too large.
  thread_local const Decompressor kContext(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  ZSTD_DCtx_reset(kContext.get(), ZSTD_reset_session_only);
  ZSTD_DCtx_refPrefix(kContext.get(), prefix.data(), prefix.size());
  const std::size_t size = ZSTD_decompressDCtx(kContext.get(), content.data(), content.size(),
                                               frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != content.size()) {
    return {StatusCode::kInvalidData,
            StrCat("compressed block is damaged: ", ZSTD_getErrorName(size))};
  }
  return {};
}

}  // namespace

Bytes Compress(ByteSpan bytes, int level) {
  return CompressWith(MakeCompressor(level).get(), bytes);
}

Bytes CompressAgainst(ByteSpan prefix, ByteSpan bytes, int level) {
  const Compressor context = MakeCompressor(level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, WindowLog(prefix.size() + bytes.size()));
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_enableLongDistanceMatching, 1);
  ZSTD_CCtx_refPrefix(context.get(), prefix.data(), prefix.size());
  return CompressWith(context.get(), bytes);
}

Result<Bytes> Decompress(ByteSpan frame, std::size_t expected_size) {
  return DecompressAgainst({}, frame, expected_size);
}

Status DecompressInto(ByteSpan frame, std::span<std::uint8_t> content) {
  ATLAS_RETURN_IF_ERROR(CheckFrame(frame, content.size()));
  return Unpack({}, frame, content);
}

Result<Bytes> DecompressAgainst(ByteSpan prefix, ByteSpan frame, std::size_t expected_size) {
  if (Status status = CheckFrame(frame, expected_size); !status.ok()) {
    return Error(std::move(status));
  }
  Bytes bytes(expected_size);
  if (Status status = Unpack(prefix, frame, bytes); !status.ok()) {
    return Error(std::move(status));
  }
  return bytes;
}

}  // namespace atlas
