# How tests/ and the headers precompiled for it are compiled. A test that fails names its line by itself; and what checks
# each pointer that a test itself looks through takes as long to compile as the rest of it (Eigen's expressions above all):
# of that alone sanitized tests have what AddressSanitizer sees. What they test has all of it.
set(ATLAS_TEST_OPTIONS $<$<CONFIG:RelWithDebInfo>:-O1>)
if(ATLAS_SANITIZE OR CMAKE_BUILD_TYPE STREQUAL "RelWithDebInfo")
  list(APPEND ATLAS_TEST_OPTIONS -g0)
endif()
if(ATLAS_SANITIZE MATCHES "undefined")
  list(APPEND ATLAS_TEST_OPTIONS -fno-sanitize=null,alignment,object-size)
endif()
