#pragma once

// SCARP_UNDER_ASAN: whether AddressSanitizer, which asks for memory of its own, watches the tests.
#if defined(__SANITIZE_ADDRESS__)
#define SCARP_UNDER_ASAN
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SCARP_UNDER_ASAN
#endif
#endif
