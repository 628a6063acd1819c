// H5Web on the bytes of /result.h5, opened at its root: what it shows is the file's default plot.
import '@h5web/app/styles.css';
import { App } from '@h5web/app';
import { H5WasmBufferProvider } from '@h5web/h5wasm';
import { createRoot } from 'react-dom/client';

const buffer = await (await fetch('/result.h5')).arrayBuffer();
createRoot(document.getElementById('root')).render(
  <H5WasmBufferProvider filename="result.h5" buffer={buffer}>
    <App propagateErrors />
  </H5WasmBufferProvider>,
);
