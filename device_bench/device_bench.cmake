# device_bench: the estimators on an OpenCL device, as one file to copy to a machine without our libraries.
#
# A second build of the rooms' own sources. fmt, nlohmann-json and CLI11 are compiled in from their headers, TBB is
# replaced behind core/parallel.h, the C++ runtime is linked statically; what stays is libOpenCL.so.1 and the C library.
set(device_bench_sources
    device_bench/main.cc
    device_bench/no_cache.cc
    device_bench/parallel.cc
    core/colour.cc
    core/console.cc
    core/error.cc
    core/execution.cc
    core/file.cc
    core/file_kind.cc
    core/input_file.cc
    core/measures.cc
    core/outputs.cc
    core/printable.cc
    core/spare_descriptors.cc
    core/progress.cc
    core/staged_file.cc
    core/stopwatch.cc
    lightfield/basis.cc
    lightfield/light_field.cc
    lightfield/light_vector.cc
    lightfield/projected_texels.cc
    render/device/device.cc
    render/device/device_tuning.cc
    render/device/kernel_profile.cc
    render/device/program.cc
    render/lights/luminaire_on_device.cc
    render/lights/luminaire_params.cc
    render/lights/patch_shadows.cc
    render/lights/shadow_maps.cc
    scene/transform.cc
    bench/bench_nearfield.cc
    render/accuracy/car2.cc
    render/accuracy/lamp_tables.cc)
# A new estimator and its tables are part of the bench without a line here; reading, writing and keeping files is not.
file(GLOB device_bench_estimators CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     preprocess/*.cc render/estimators/*.cc)
list(FILTER device_bench_estimators EXCLUDE REGEX "_io\\.cc$|/kept_")

add_executable(device_bench ${device_bench_sources} ${device_bench_estimators}
                            $<TARGET_OBJECTS:luxfield_render_kernels>)
target_include_directories(device_bench PRIVATE ${LUXFIELD_INCLUDE})
luxfield_foreign_headers(device_bench OpenCL::OpenCL fmt::fmt-header-only nlohmann_json::nlohmann_json CLI11::CLI11)
target_link_libraries(device_bench PRIVATE OpenCL::OpenCL fmt::fmt-header-only nlohmann_json::nlohmann_json
                                           CLI11::CLI11 Threads::Threads)
target_compile_options(device_bench PRIVATE -fno-sanitize=all)  # instrumented sections stay, and miss the rooms not compiled in
target_link_options(device_bench PRIVATE -static-libstdc++ -static-libgcc -Wl,--gc-sections)
# A libOpenCL.so.1 beside the program serves where the machine has a driver but no loader.
set_target_properties(device_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR} BUILD_RPATH "$ORIGIN")
