//! Intel's Open Image Denoise 2, loaded at run time.
//!
//! The declarations follow the library's header oidn.h of version 2.
#![allow(unsafe_code)]

use std::ffi::{CStr, OsStr, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::mem::ManuallyDrop;
use std::ptr::null;

use domelight::{Rgb, RgbImage};
use libloading::Library;

/// `OIDN_DEVICE_TYPE_CPU`: pixels need no copies, and results do not depend on the graphics card.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`
const FLOAT3: c_int = 3;

#[repr(C)]
struct DeviceObject {
    _private: [u8; 0],
}
type DeviceHandle = *mut DeviceObject;

#[repr(C)]
struct FilterObject {
    _private: [u8; 0],
}
type FilterHandle = *mut FilterObject;

macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Those of the library that are used.
        #[allow(non_snake_case)]
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            fn find(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: the types are those of the header.
                unsafe {
                    Ok(Self { $($name: *library.get(concat!(stringify!($name), "\0"))?,)* })
                }
            }
        }
    };
}
functions! {
    oidnNewDevice(c_int) -> DeviceHandle;
    oidnReleaseDevice(DeviceHandle);
    oidnCommitDevice(DeviceHandle);
    oidnGetDeviceInt(DeviceHandle, *const c_char) -> c_int;
    oidnSetDeviceInt(DeviceHandle, *const c_char, c_int);
    oidnSetDeviceBool(DeviceHandle, *const c_char, bool);
    oidnGetDeviceError(DeviceHandle, *mut *const c_char) -> c_int;
    oidnNewFilter(DeviceHandle, *const c_char) -> FilterHandle;
    oidnReleaseFilter(FilterHandle);
    oidnSetSharedFilterImage(
        FilterHandle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize
    );
    oidnSetFilterBool(FilterHandle, *const c_char, bool);
    oidnCommitFilter(FilterHandle);
    oidnExecuteFilter(FilterHandle);
}

/// The library and a device of it.
pub(super) struct Device {
    functions: Functions,
    handle: DeviceHandle,
    /// Never unloaded: threads of the library may still run its code at the end of the process.
    _library: ManuallyDrop<Library>,
}

impl Device {
    /// Loads the library of that file name, or of that name where the system's loader looks.
    pub(super) fn load(name: &OsStr, n_threads: usize) -> Result<Self, String> {
        // SAFETY: the caller names the library, whose initializers have no preconditions.
        let library = unsafe { Library::new(name) }.map_err(|error| error.to_string())?;
        let functions = Functions::find(&library)
            .map_err(|error| format!("this is not Open Image Denoise 2 ({error})"))?;
        // SAFETY: a device of the CPU has no preconditions.
        let handle = unsafe { (functions.oidnNewDevice)(CPU) };
        if handle.is_null() {
            return Err("it cannot create a CPU device".into());
        }
        let device = Self { functions, handle, _library: ManuallyDrop::new(library) };
        let [major, minor, _] = device.version();
        if major < 2 {
            return Err(format!("this is version {major}.{minor}, and 2 or later is needed"));
        }
        let n_threads = c_int::try_from(n_threads).unwrap_or(c_int::MAX);
        let f = &device.functions;
        // SAFETY: the device lives; the names are C strings.
        unsafe {
            (f.oidnSetDeviceInt)(handle, c"numThreads".as_ptr(), n_threads);
            // Other programs share the machine.
            (f.oidnSetDeviceBool)(handle, c"setAffinity".as_ptr(), false);
            (f.oidnCommitDevice)(handle);
        }
        device.check()?;
        Ok(device)
    }

    /// Major, minor, patch.
    pub(super) fn version(&self) -> [c_int; 3] {
        // SAFETY: the device lives; the names are C strings.
        [c"versionMajor", c"versionMinor", c"versionPatch"]
            .map(|name| unsafe { (self.functions.oidnGetDeviceInt)(self.handle, name.as_ptr()) })
    }

    /// The device's error since it was last asked.
    fn check(&self) -> Result<(), String> {
        let mut message = null();
        // SAFETY: the device lives; the message does until its next error.
        let text = unsafe {
            if (self.functions.oidnGetDeviceError)(self.handle, &raw mut message) == 0 {
                return Ok(());
            }
            if message.is_null() {
                "unknown error".into()
            } else {
                CStr::from_ptr(message).to_string_lossy().into_owned()
            }
        };
        Err(text)
    }

    /// Filters HDR color, by features of the same size.
    pub(super) fn filter(
        &self,
        color: &RgbImage,
        features: &[(&CStr, &RgbImage)],
    ) -> Result<RgbImage, String> {
        let (width, height) = (color.width, color.height);
        let mut output = RgbImage::filled(width, height, Rgb::BLACK);
        let f = &self.functions;
        // SAFETY: the device lives.
        let handle = unsafe { (f.oidnNewFilter)(self.handle, c"RT".as_ptr()) };
        if handle.is_null() {
            self.check()?;
            return Err("it cannot create a filter".into());
        }
        let filter = Filter { functions: f, handle, _images: PhantomData };
        filter.set(c"color", color, width, height)?;
        for (name, image) in features {
            filter.set(name, image, width, height)?;
        }
        // SAFETY: filter and device live. `output` has width × height texels of three floats, nobody else refers to it,
        // and it outlives the filter, which is released before `output` is returned.
        unsafe {
            let pixels = output.pixels.as_mut_ptr().cast();
            let name = c"output".as_ptr();
            (f.oidnSetSharedFilterImage)(handle, name, pixels, FLOAT3, width, height, 0, 0, 0);
            (f.oidnSetFilterBool)(handle, c"hdr".as_ptr(), true);
            (f.oidnCommitFilter)(handle);
            (f.oidnExecuteFilter)(handle);
        }
        drop(filter);
        self.check()?;
        Ok(output)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: made by oidnNewDevice, released once; filters borrow the device.
        unsafe { (self.functions.oidnReleaseDevice)(self.handle) };
    }
}

/// A filter, whose images outlive it.
struct Filter<'a> {
    functions: &'a Functions,
    handle: FilterHandle,
    _images: PhantomData<&'a RgbImage>,
}

impl<'a> Filter<'a> {
    /// Sets an image that is read.
    fn set(
        &self,
        name: &CStr,
        image: &'a RgbImage,
        width: usize,
        height: usize,
    ) -> Result<(), String> {
        if (image.width, image.height) != (width, height) || image.pixels.len() != width * height {
            return Err(format!("{} is of another size", name.to_string_lossy()));
        }
        let pixels = image.pixels.as_ptr().cast_mut().cast();
        let set = self.functions.oidnSetSharedFilterImage;
        // SAFETY: the filter lives, the image outlives it and has width × height texels of three floats (`Rgb` is
        // repr(C)), which the library only reads.
        unsafe { set(self.handle, name.as_ptr(), pixels, FLOAT3, width, height, 0, 0, 0) };
        Ok(())
    }
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // SAFETY: made by oidnNewFilter, released once.
        unsafe { (self.functions.oidnReleaseFilter)(self.handle) };
    }
}
