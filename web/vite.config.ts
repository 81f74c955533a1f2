import { svelte } from '@sveltejs/vite-plugin-svelte'
import { defineConfig } from 'vitest/config'

// The page is served under any path prefix and under `Content-Security-Policy: default-src 'self'`:
// relative addresses, and no asset turned into a data: address.
export default defineConfig({
  base: './',
  plugins: [svelte()],
  build: {
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: 'es2022',
    cssTarget: 'es2022',
  },
  // `BUSBAR_URL=http://127.0.0.1:8080 npm run dev`: the page from source, the data from a running gateway.
  server: { proxy: { '/api': process.env.BUSBAR_URL ?? 'http://127.0.0.1:8080' } },
  resolve: process.env.VITEST ? { conditions: ['browser'] } : {},
  test: {
    environment: 'happy-dom',
    include: ['src/**/*.test.ts'],
  },
})
