#include "core/base/compression.h"

#include <cassert>
#include <memory>

#include <zstd.h>

#include "core/base/str_cat.h"

namespace atlas {

Bytes Compress(ByteSpan bytes, int level) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                     &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  Bytes frame(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context.get(), frame.data(), frame.size(), bytes.data(), bytes.size());
  assert(ZSTD_isError(size) == 0);  // the buffer is ZSTD_compressBound bytes long
  frame.resize(size);
  return frame;
}

Result<Bytes> Decompress(ByteSpan frame, std::size_t expected_size) {
  const unsigned long long declared = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (declared != expected_size) {
    return Error(StatusCode::kInvalidData, StrCat("compressed block does not declare the expected ",
                                                  expected_size, " bytes"));
  }
  if (ZSTD_findFrameCompressedSize(frame.data(), frame.size()) != frame.size()) {
    return Error(StatusCode::kInvalidData, "compressed block is truncated or has trailing bytes");
  }
  Bytes bytes(expected_size);
  const std::size_t size = ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != expected_size) {
    return Error(StatusCode::kInvalidData,
                 StrCat("compressed block is damaged: ", ZSTD_getErrorName(size)));
  }
  return bytes;
}

}  // namespace atlas
