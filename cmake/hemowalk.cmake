# Compiler flags and the two functions every folder uses.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# -O3 without NDEBUG surprises: contracts are chosen by HEMOWALK_SANITIZE / Debug, not by assert().
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -g1 -DNDEBUG")

find_package(OpenMP REQUIRED)

if(HEMOWALK_CUDA)
  # Debian's CMake 3.25 does not know nvcc's C++20 flag.
  set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
  set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
  if(NOT CMAKE_CUDA_COMPILER AND EXISTS /usr/local/cuda/bin/nvcc)
    set(CMAKE_CUDA_COMPILER /usr/local/cuda/bin/nvcc)
  endif()
  enable_language(CUDA)
  find_package(CUDAToolkit REQUIRED)
  set(CMAKE_CUDA_STANDARD 20)
endif()

add_library(hemowalk_flags INTERFACE)
target_include_directories(hemowalk_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(hemowalk_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wno-maybe-uninitialized -fno-math-errno -fno-trapping-math>)
if(HEMOWALK_NATIVE)
  target_compile_options(hemowalk_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-march=native -mprefer-vector-width=512>)
  # What the host makes of a kernel has the bits of the host's own code: the same instructions, fused ones included.
  target_compile_options(hemowalk_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-march=native$<COMMA>-mprefer-vector-width=512>)
endif()
if(HEMOWALK_SANITIZE)
  target_compile_options(hemowalk_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=address,undefined -fno-omit-frame-pointer>)
  target_link_options(hemowalk_flags INTERFACE -fsanitize=address,undefined)
  target_compile_definitions(hemowalk_flags INTERFACE HEMOWALK_CHECKED=1)
endif()
target_link_libraries(hemowalk_flags INTERFACE OpenMP::OpenMP_CXX)
if(HEMOWALK_CUDA)
  target_compile_definitions(hemowalk_flags INTERFACE HEMOWALK_CUDA=1)
  target_compile_options(hemowalk_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CUDA>:--expt-relaxed-constexpr -diag-suppress=554,1675 -Werror=cross-execution-space-call -Xcompiler=-fopenmp -Xcompiler=-Wall
      -Xcompiler=-fno-math-errno$<COMMA>-fno-trapping-math>)
  target_link_libraries(hemowalk_flags INTERFACE CUDA::cudart)
endif()

# hemowalk_library(<name> SOURCES a.cpp .. [KERNELS b.cpp ..] [LINK lib ..])
# KERNELS launch device code: nvcc compiles them when HEMOWALK_CUDA is on, the host compiler otherwise.
function(hemowalk_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;KERNELS;LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES} ${ARG_KERNELS})
  if(HEMOWALK_CUDA AND ARG_KERNELS)
    set_source_files_properties(${ARG_KERNELS} PROPERTIES LANGUAGE CUDA)
  endif()
  target_link_libraries(${name} PUBLIC hemowalk_flags ${ARG_LINK})
endfunction()

# hemowalk_test(<name> SOURCES unit/test_x.cpp .. LINK lib .. [LABELS unit ..] [TIMEOUT seconds] [EACH [FIRST case ..]])
# EACH: one test per case (hours in all), of one thread each, so that as many run at once as there are cores; those
# named by FIRST, the longest, are started first (ctest orders by COST, or by the seconds a case took before).
function(hemowalk_test name)
  cmake_parse_arguments(ARG "EACH" "TIMEOUT" "SOURCES;LINK;LABELS;FIRST" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  target_compile_definitions(${name} PRIVATE HEMOWALK_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  if(ARG_EACH)
    set(discovery DISCOVERY_TIMEOUT 60 PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} ENVIRONMENT "OMP_NUM_THREADS=1")
    list(JOIN ARG_FIRST ":" first)
    if(first)
      gtest_discover_tests(${name} TEST_PREFIX ${name}. TEST_FILTER "${first}" ${discovery} COST 100000)
      string(PREPEND first "-")
    endif()
    gtest_discover_tests(${name} TEST_PREFIX ${name}. TEST_FILTER "${first}" ${discovery})
    return()
  endif()
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT})
endfunction()
